#include "common/report/spread.h"

#include <gtest/gtest.h>

#include <vector>

namespace mray {
namespace {

TEST(Spread, QuantilesLieBetweenValues) {
    const std::vector<double> values = {1, 2, 4, 8};
    EXPECT_EQ(quantile(values, 0), 1);
    EXPECT_EQ(quantile(values, 1), 8);
    EXPECT_EQ(quantile(values, 0.5), 3);
    EXPECT_EQ(quantile(values, 0.25), 1.75);
    EXPECT_EQ(quantile(std::vector<double>{7}, 0.3), 7);
}

TEST(Spread, IsTheMiddleHalfInPercentOfTheMedian) {
    const Spread spread = spread_of(std::vector<double>{5, 1, 2, 4, 3});
    EXPECT_EQ(spread.least, 1);
    EXPECT_EQ(spread.median, 3);
    EXPECT_EQ(spread.percent, 100.0 * 2 / 3);
}

}  // namespace
}  // namespace mray
