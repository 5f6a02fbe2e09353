// The cost of queries: rays are counted exactly, and times are taken from samples.
#include "library/src/queries/query_cost.h"

#include <gtest/gtest.h>

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <thread>

#include "tests/support/run_together.h"

namespace morphray::detail {
namespace {

TEST(QueryCost, CountsTheRaysOfBatchesOfAllSizesExactly) {
    QueryCost cost;
    std::uint64_t rays = 0;
    std::uint64_t calls = 0;
    for (const bool resets : {true, false}) {
        for (std::uint64_t size = 0; size <= 300; ++size) {
            cost.measure(size, [&] { ++calls; });
            rays += size;
            EXPECT_EQ(cost.rays(), rays);
        }
        cost.add(1, 1000);
        EXPECT_EQ(cost.rays(), rays + 1000);
        EXPECT_GT(cost.ms(), 0.9);
        if (!resets) continue;
        cost.reset();
        rays = 0;
        EXPECT_EQ(cost.rays(), 0u);
        EXPECT_EQ(cost.ms(), 0);
    }
    EXPECT_EQ(calls, 602u);
}

/// More threads than have an index of their own.
TEST(QueryCost, CountsTheRaysOfManyThreadsExactly) {
    QueryCost cost;
    mray::test::run_together(80, [&](std::size_t i) {
        for (int k = 0; k < 2000; ++k) cost.measure(i + 1, [] {});
    });
    EXPECT_EQ(cost.rays(), 2000u * 80 * 81 / 2);
}

/// Each call of fewer than 64 rays is timed if it has the 64th, 128th ... ray of its thread.
TEST(QueryCost, TimesShortCallsOnceIn64Rays) {
    for (const std::uint64_t size : {1, 2, 16, 63}) {
        QueryCost cost;
        const std::uint64_t before = (64 - 1) / size;
        for (std::uint64_t i = 0; i < before; ++i) {
            cost.measure(size, [] { std::this_thread::sleep_for(std::chrono::microseconds(1)); });
            EXPECT_EQ(cost.ms(), 0) << size << ", call " << i;
        }
        cost.measure(size, [] { std::this_thread::sleep_for(std::chrono::microseconds(100)); });
        // It stands for 64 rays.
        EXPECT_GE(cost.ms(), 0.1 * 64 / static_cast<double>(size) * 0.99) << size;
    }
    QueryCost cost;
    cost.measure(64, [] { std::this_thread::sleep_for(std::chrono::microseconds(100)); });
    EXPECT_GE(cost.ms(), 0.099);
}

}  // namespace
}  // namespace morphray::detail
