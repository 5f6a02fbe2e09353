#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "report/compare.h"
#include "report/shell.h"
#include "report/spread.h"
#include "report/table.h"

namespace mray {
namespace {

TEST(Shell, SurvivesAShell) {
    EXPECT_EQ(shell_quoted("builtin:cloth:100"), "builtin:cloth:100");
    EXPECT_EQ(shell_quoted(""), "''");
    EXPECT_EQ(shell_quoted("a b"), "'a b'");
    EXPECT_EQ(shell_quoted("it's $HOME"), "'it'\\''s $HOME'");
    const std::vector<std::string> arguments = {"morphray", "a b"};
    EXPECT_EQ(shell_line(arguments), "morphray 'a b'");
}

TEST(Spread, IsTheMiddleHalfInPercentOfTheMedian) {
    const Spread spread = spread_of(std::vector<double>{5, 1, 2, 4, 3});
    EXPECT_EQ(spread.least, 1);
    EXPECT_EQ(spread.median, 3);
    EXPECT_EQ(spread.percent, 100.0 * 2 / 3);
    const Spread even = spread_of(std::vector<double>{1, 8, 4, 2});
    EXPECT_EQ(even.median, 3);
    EXPECT_EQ(even.percent, 100 * (5 - 1.75) / 3);
}

TEST(Table, AlignsNumbersRightAndTextLeft) {
    Table table({"n", "name"});
    table.add({"1", "a"});
    table.add({"100", "bcd"});
    EXPECT_EQ(table.text(), "  n  name\n  1  a\n100  bcd\n");
}

TEST(Table, QuotesCellsOfCsv) {
    Table table({"a", "b"});
    table.add({"1,2", "say \"x\""});
    EXPECT_EQ(table.csv(), "a,b\n\"1,2\",\"say \"\"x\"\"\"\n");
}

constexpr std::uint32_t kGrey = 0xFF808080;

/// A frame in which every pixel hits triangle 5, but for the last one, which misses.
Frame sample_frame(std::uint32_t width = 8, std::uint32_t height = 6) {
    Frame frame;
    frame.width = width;
    frame.height = height;
    const std::size_t size = std::size_t{width} * height;
    frame.hits.assign(size, Hit{.t = 3.5f, .u = 0.25f, .v = 0.5f, .prim_id = 5});
    frame.hits.back() = no_hit();
    frame.occlusion.assign(size, 2);
    frame.pixels.assign(size, kGrey);
    return frame;
}

float next_float(float x) { return std::nextafter(x, std::numeric_limits<float>::infinity()); }

TEST(CompareFrames, TakesAnEmptyFrame) { EXPECT_EQ(compare_frames(Frame{}, Frame{}).total(), 0u); }

TEST(CompareFrames, CountsEachKind) {
    Frame actual = sample_frame();
    actual.hits[0] = no_hit();
    actual.hits[1] = no_hit();
    actual.hits.back() = actual.hits[2];
    actual.hits[3].prim_id = 6;
    actual.hits[4].t = next_float(3.5f);
    actual.hits[5].u = next_float(0.25f);
    actual.hits[6].v = next_float(0.5f);
    actual.occlusion[7] = 3;
    actual.pixels[8] ^= 1;
    const FrameDifference difference = compare_frames(sample_frame(), actual);
    EXPECT_EQ(difference.false_miss, 2u);
    EXPECT_EQ(difference.false_hit, 1u);
    EXPECT_EQ(difference.prim_id, 1u);
    EXPECT_EQ(difference.t, 1u);
    EXPECT_EQ(difference.uv, 2u);
    EXPECT_EQ(difference.occlusion, 1u);
    EXPECT_EQ(difference.colour, 1u);
    EXPECT_EQ(difference.total(), 9u);
    EXPECT_EQ(describe(difference),
              "9 pixels differ: 2 false misses, 1 false hit, 1 prim_id, 1 t, 2 u or v, "
              "1 occlusion, 1 colour");
}

TEST(CompareFrames, CountsAPixelOnceForItsFirstDifference) {
    Frame actual = sample_frame();
    actual.hits[4] = {.t = 1, .u = 0, .v = 0, .prim_id = 7};
    actual.occlusion[4] = 0;
    actual.pixels[4] = 0;
    const FrameDifference difference = compare_frames(sample_frame(), actual);
    EXPECT_EQ(difference.prim_id, 1u);
    EXPECT_EQ(difference.total(), 1u);
    EXPECT_EQ(difference.first[0].actual_occlusion, 0u);
    EXPECT_EQ(difference.first[0].expected_occlusion, 2u);
    EXPECT_EQ(difference.first[0].actual_pixel, 0u);
    EXPECT_EQ(difference.first[0].expected_pixel, kGrey);
    EXPECT_EQ(describe(difference), "1 pixel differs: 1 prim_id");
}

TEST(CompareFrames, ComparesNotANumberAndZerosAsBits) {
    const float nan = std::bit_cast<float>(0x7FC00000u);
    const float other_nan = std::bit_cast<float>(0x7FC00001u);
    Frame expected = sample_frame();
    Frame actual = sample_frame();
    expected.hits[0].t = actual.hits[0].t = nan;
    EXPECT_EQ(compare_frames(expected, actual).total(), 0u);
    actual.hits[0].t = other_nan;
    EXPECT_EQ(compare_frames(expected, actual).t, 1u);
    actual = expected;
    expected.hits[1].u = 0.0f;
    actual.hits[1].u = -0.0f;
    EXPECT_EQ(compare_frames(expected, actual).uv, 1u);
}

TEST(CompareFrames, KeepsTheFirstOnesAndCountsAll) {
    Frame actual = sample_frame();
    for (std::uint32_t& pixel : actual.pixels) pixel ^= 1;
    const FrameDifference difference = compare_frames(sample_frame(), actual, 3);
    EXPECT_EQ(difference.colour, 48u);
    ASSERT_EQ(difference.first.size(), 3u);
    EXPECT_EQ(difference.first[2].x, 2u);
    EXPECT_EQ(difference.first[2].y, 0u);
    EXPECT_TRUE(compare_frames(sample_frame(), actual, 0).first.empty());
}

}  // namespace
}  // namespace mray
