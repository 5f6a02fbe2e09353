#include "tools/measure/median.h"

#include <gtest/gtest.h>

#include <utility>
#include <vector>

namespace mray {
namespace {

TEST(Median, IsTheMiddleOrTheMeanOfTwo) {
    EXPECT_EQ(median({3}), 3);
    EXPECT_EQ(median({5, 1, 3}), 3);
    EXPECT_EQ(median({4, 1, 2, 8}), 3);
}

TEST(LowerMedian, IsTheMiddleOrTheLowerOfTwo) {
    EXPECT_EQ(lower_median(std::vector{3.0}), 3);
    EXPECT_EQ(lower_median(std::vector{5.0, 1.0, 3.0}), 3);
    EXPECT_EQ(lower_median(std::vector{4.0, 1.0, 2.0, 8.0}), 2);
    EXPECT_EQ(lower_median(std::vector{2.0, 1.0}), 1);
}

TEST(LowerMedian, IsChosenByTheKeyAndKeepsTheRest) {
    using Pair = std::pair<int, char>;
    const std::vector<Pair> values = {{7, 'a'}, {1, 'd'}, {5, 'b'}, {3, 'c'}};
    EXPECT_EQ(lower_median(values, [](const Pair& p) { return p.first; }), Pair(3, 'c'));
    EXPECT_EQ(lower_median(values, [](const Pair& p) { return p.second; }), Pair(5, 'b'));
}

}  // namespace
}  // namespace mray
