#include "report/spread.h"

#include <gtest/gtest.h>

#include <vector>

namespace mray {
namespace {

TEST(Spread, IsTheMiddleHalfInPercentOfTheMedian) {
    const Spread spread = spread_of(std::vector<double>{5, 1, 2, 4, 3});
    EXPECT_EQ(spread.least, 1);
    EXPECT_EQ(spread.median, 3);
    EXPECT_EQ(spread.percent, 100.0 * 2 / 3);
    const Spread even = spread_of(std::vector<double>{1, 8, 4, 2});
    EXPECT_EQ(even.median, 3);
    EXPECT_EQ(even.percent, 100 * (5 - 1.75) / 3);
}

}  // namespace
}  // namespace mray
