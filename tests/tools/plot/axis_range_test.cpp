// Ranges and ticks of axes.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tools/plot/axis_range.h"

namespace mray::plot {
namespace {

AxisRange fit(const Axis& axis, const std::vector<double>& values) {
    return fit_axis(axis, Direction::kX, values);
}

TEST(AxisRange, SmallRangesAreLinearFromZero) {
    const AxisRange range = fit({}, {0.12, 0.31, 0.29});
    EXPECT_EQ(range.log_base, 0);
    EXPECT_EQ(range.lower, 0);
    EXPECT_GE(range.upper, 0.31);
    EXPECT_EQ(range.ticks.front().text, "0");
}

TEST(AxisRange, WideRangesAreLogarithmicUnlessAValueIsZero) {
    EXPECT_EQ(fit({}, {1, 31}).log_base, 10);
    EXPECT_EQ(fit({}, {1, 30}).log_base, 0);
    EXPECT_EQ(fit({}, {0, 1, 31}).log_base, 0);
}

TEST(AxisRange, ShowsEveryFiniteValue) {
    const double infinite = std::numeric_limits<double>::infinity();
    for (const Scale scale : {Scale::kAuto, Scale::kLinear, Scale::kLog10, Scale::kLog2}) {
        for (const bool tight : {false, true}) {
            for (const std::vector<double>& values :
                 std::vector<std::vector<double>>{{},
                                                  {5},
                                                  {1, 4096},
                                                  {1e-9, 1e9},
                                                  {0.3, 0.3000001},
                                                  {1e-6, infinite, std::nan(""), 2},
                                                  {999999, 1000001}}) {
                const AxisRange range = fit({.scale = scale, .tight = tight}, values);
                EXPECT_LT(range.lower, range.upper);
                EXPECT_FALSE(range.ticks.empty());
                EXPECT_LT(range.ticks.size(), 20u);
                for (const Tick& tick : range.ticks) {
                    EXPECT_GE(range.fraction(tick.at), -1e-6) << tick.text;
                    EXPECT_LE(range.fraction(tick.at), 1 + 1e-6) << tick.text;
                }
                for (const double value : values) {
                    if (!std::isfinite(value)) continue;
                    EXPECT_GE(range.fraction(value), -1e-6) << value;
                    EXPECT_LE(range.fraction(value), 1 + 1e-6) << value;
                }
            }
        }
    }
}

TEST(AxisRange, ZerosStandBelowALogarithmicAxisUnderTheirName) {
    const AxisRange range = fit({.scale = Scale::kLog10, .zero_name = "none"}, {0, 77, 4e4});
    EXPECT_EQ(range.ticks.front().text, "none");
    EXPECT_GT(range.fraction(0), 0);
    EXPECT_LT(range.fraction(0), range.fraction(77) - 0.1);
    EXPECT_EQ(range.place(0), range.ticks.front().at);
    EXPECT_EQ(range.place(77), 77);
    for (std::size_t i = 1; i < range.ticks.size(); ++i)
        EXPECT_GT(range.ticks[i].at, range.place(0));
}

TEST(AxisRange, BeginsAtTheLeastValueThatThereCanBe) {
    const Axis axis{.scale = Scale::kLog10, .zero_name = "none", .least_positive = 15};
    EXPECT_EQ(fit(axis, {0, 4e4}).ticks[1].text, "10");
    const AxisRange none = fit(axis, {0, 0});
    EXPECT_EQ(none.ticks[0].text, "none");
    EXPECT_GE(none.ticks[1].at, 10);
    for (const double least : {10.0, 15.0, 20.0, 50.0, 99.0}) {
        const Axis other{.scale = Scale::kLog10, .zero_name = "none", .least_positive = least};
        EXPECT_LT(fit(other, {0, 4e4}).zero_at, least / 3);
    }
}

TEST(AxisRange, WithoutZerosThereIsNoPlaceForThem) {
    const AxisRange range = fit({.scale = Scale::kLog10, .zero_name = "none"}, {77, 4e4});
    EXPECT_EQ(range.zero_at, 0);
    EXPECT_NE(range.ticks.front().text, "none");
}

TEST(AxisRange, NamesGoFromLeftToRightAndFromTopToBottom) {
    const Axis axis{.names = {"a", "b", "c"}};
    EXPECT_LT(fit_axis(axis, Direction::kX, {}).fraction(0),
              fit_axis(axis, Direction::kX, {}).fraction(2));
    EXPECT_GT(fit_axis(axis, Direction::kY, {}).fraction(0),
              fit_axis(axis, Direction::kY, {}).fraction(2));
    EXPECT_EQ(fit_axis(axis, Direction::kY, {}).ticks[1].text, "b");
}

}  // namespace
}  // namespace mray::plot
