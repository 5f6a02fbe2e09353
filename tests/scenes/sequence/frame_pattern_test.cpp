#include "scenes/sequence/frame_pattern.h"

#include <gtest/gtest.h>

#include "tests/support/thrown_error.h"

namespace mray {
namespace {

using namespace test;

TEST(FramePattern, NamesFrames) {
    EXPECT_EQ(FramePattern("frame_%04d.obj").file_name(7), "frame_0007.obj");
    EXPECT_EQ(FramePattern("frame_%04d.obj").file_name(12345), "frame_12345.obj");
    EXPECT_EQ(FramePattern("%d").file_name(7), "7");
    EXPECT_EQ(FramePattern("a/b%%c/50%%_%09d%%.obj").file_name(1), "50%_000000001%.obj");
    EXPECT_EQ(FramePattern("a/b%%c/50%%_%09d%%.obj").folder(), "a/b%c/");
    EXPECT_EQ(FramePattern("/%d.obj").folder(), "/");
    EXPECT_EQ(FramePattern("%d.obj").folder(), "");
}

TEST(FramePattern, KnowsItsOwnNamesOnly) {
    const FramePattern padded("f_%03d.obj");
    EXPECT_EQ(padded.number_of("f_007.obj"), 7u);
    EXPECT_EQ(padded.number_of("f_1234.obj"), 1234u);
    const FramePattern plain("f_%d.obj");
    EXPECT_EQ(plain.number_of("f_0.obj"), 0u);
    for (const char* name :
         {"f_7.obj", "f_0007.obj", "f_-07.obj", "f_+07.obj", "f_00a.obj", "f_.obj", "g_007.obj",
          "f_007.objx", "f_0x7.obj", "", "f_1e3.obj", "f_1234567890.obj"}) {
        EXPECT_FALSE(padded.number_of(name)) << name;
    }
    EXPECT_FALSE(plain.number_of("f_007.obj"));
    EXPECT_FALSE(FramePattern("aa%daa").number_of("aaa"));
}

TEST(FramePattern, RefusesEveryOtherUseOfThePercentSign) {
    for (const char* pattern : {"a.obj",
                                "",
                                "%s.obj",
                                "%n",
                                "%d%d.obj",
                                "%d_%04d.obj",
                                "%99999999d.obj",
                                "%10d",
                                "%010d",
                                "%4d.obj",
                                "%00d",
                                "%0d",
                                "%-4d",
                                "%+d",
                                "% d",
                                "%i",
                                "%u",
                                "%x",
                                "%ld",
                                "%*d",
                                "%1$d",
                                "%.3d",
                                "%",
                                "a%",
                                "%0",
                                "%04",
                                "%%",
                                "%%d.obj",
                                "dir_%d/a.obj",
                                "dir_%d/a_%d.obj",
                                "%d/",
                                "%f",
                                "%04.obj"}) {
        EXPECT_EQ(kind_of([&] { FramePattern{pattern}; }), ErrorKind::kBadArgument) << pattern;
    }
}

}  // namespace
}  // namespace mray
