#include "tools/measure/median.h"

#include <gtest/gtest.h>

namespace mray {
namespace {

TEST(Median, IsTheMiddleOrTheMeanOfTwo) {
    EXPECT_EQ(median({3}), 3);
    EXPECT_EQ(median({5, 1, 3}), 3);
    EXPECT_EQ(median({4, 1, 2, 8}), 3);
}

}  // namespace
}  // namespace mray
