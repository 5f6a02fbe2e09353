#include "app/animation/frames.h"

#include <gtest/gtest.h>

#include "tests/support/thrown_error.h"

namespace mray::app {
namespace {

using namespace test;

using Frames = std::vector<double>;

TEST(FrameRange, ReadsNumbersAndRanges) {
    EXPECT_EQ(parse_frame_range("7"), Frames{7});
    EXPECT_EQ(parse_frame_range("2.5"), Frames{2.5});
    EXPECT_EQ(parse_frame_range("0..3"), (Frames{0, 1, 2, 3}));
    EXPECT_EQ(parse_frame_range("5..5"), Frames{5});
    EXPECT_EQ(parse_frame_range("-1..1"), (Frames{-1, 0, 1}));
    EXPECT_EQ(parse_frame_range("0..1:0.25"), (Frames{0, 0.25, 0.5, 0.75, 1}));
    EXPECT_EQ(parse_frame_range("1.5..2.:.25"), (Frames{1.5, 1.75, 2}));
    EXPECT_EQ(parse_frame_range("0..5:2"), (Frames{0, 2, 4}));
}

TEST(FrameRange, ReadsListsOfThem) {
    EXPECT_EQ(parse_frame_range("0,7,20"), (Frames{0, 7, 20}));
    EXPECT_EQ(parse_frame_range("0..8:4,20"), (Frames{0, 4, 8, 20}));
    EXPECT_EQ(parse_frame_range("-1.5,0..1,1.25,2..3:0.5"), (Frames{-1.5, 0, 1, 1.25, 2, 2.5, 3}));
    // A range ends with its last frame, which need not be B.
    EXPECT_EQ(parse_frame_range("0..5:2,5"), (Frames{0, 2, 4, 5}));
}

TEST(FrameRange, RefusesListsThatDoNotIncrease) {
    for (const char* text : {"7,0", "0,0", "0..8:4,8", "0..8,3..12", "1,2,1", "0..0.3:0.1,0.3"}) {
        EXPECT_EQ(test::kind_of([&] { parse_frame_range(text); }), ErrorKind::kBadArgument) << text;
    }
    EXPECT_EQ(
        test::message_of([] { parse_frame_range("0..8:4,20,7"); }),
        "frames '0..8:4,20,7': 7 does not come after 20; they must increase; write A, A..B or "
        "A..B:STEP, such as 0..20:0.5, or several of them with commas, such as 0,7,20");
}

TEST(FrameRange, DoesNotDrift) {
    const Frames frames = parse_frame_range("0..1000:0.1");
    ASSERT_EQ(frames.size(), 10001u);
    for (std::size_t i = 0; i + 1 < frames.size(); ++i) {
        EXPECT_EQ(frames[i], static_cast<double>(i) * 0.1);
    }
    EXPECT_EQ(frames.back(), 1000);
}

TEST(FrameRange, IncludesTheLastFrameWhenItIsHit) {
    EXPECT_EQ(parse_frame_range("0..0.3:0.1").back(), 0.3);
    EXPECT_EQ(parse_frame_range("0..0.3:0.1").size(), 4u);
    EXPECT_EQ(parse_frame_range("0..20:0.25").size(), 81u);
    EXPECT_EQ(parse_frame_range("0..0.29:0.1").size(), 3u);
}

TEST(FrameRange, RefusesEverythingElse) {
    for (const char* text :
         {"",         "..",     "1..",      "..5",        "5..4",      "0..5:0",
          "0..5:-1",  "0..5:",  "0..5:1:2", "nan",        "nan..5",    "0..nan",
          "0..5:nan", "0..inf", "inf",      "0..5:inf",   "1e400",     "a",
          "a..b",     "0-5",    "0;5",      "0,",         ",5",        "0,,5",
          "0, 5",     "0,all",  "0..5,5",   " 1",         "1 ",        "0...",
          "0....5",   "1:2",    "0x1",      "0..1000000", "0..1:1e-7", "0..1:1e-320"}) {
        EXPECT_EQ(test::kind_of([&] { parse_frame_range(text); }), ErrorKind::kBadArgument) << text;
    }
}

TEST(FrameRange, AcceptsAMillionFrames) {
    EXPECT_EQ(parse_frame_range("1..1000000").size(), kMaxFrames);
    EXPECT_EQ(parse_frame_range("0,2..1000000").size(), kMaxFrames);
    EXPECT_EQ(test::kind_of([] { parse_frame_range("0..999999,2000000"); }),
              ErrorKind::kBadArgument);
    EXPECT_EQ(test::kind_of([] { parse_frame_range("-1,0..999999"); }), ErrorKind::kBadArgument);
}

}  // namespace
}  // namespace mray::app
