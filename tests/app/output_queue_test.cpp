#include "app/commands/render/output_queue.h"

#include <gtest/gtest.h>

#include <atomic>
#include <stdexcept>
#include <vector>

namespace mray::app {
namespace {

TEST(OutputQueue, RunsTasksInTheirOrder) {
    std::vector<int> done;
    OutputQueue queue(2);
    for (int i = 0; i < 100; ++i) queue.add([&done, i] { done.push_back(i); });
    queue.finish();
    ASSERT_EQ(done.size(), 100u);
    for (int i = 0; i < 100; ++i) EXPECT_EQ(done[static_cast<std::size_t>(i)], i);
}

TEST(OutputQueue, LetsNoMoreTasksWaitThanItMay) {
    for (const int most : {0, 1, 2}) {
        std::atomic<int> done = 0;
        OutputQueue queue(static_cast<std::size_t>(most));
        for (int added = 1; added <= 200; ++added) {
            queue.add([&done] { ++done; });
            EXPECT_LE(added - done, most);
        }
    }
}

TEST(OutputQueue, ThrowsTheFirstErrorAndRunsNothingAfterIt) {
    std::atomic<int> done = 0;
    OutputQueue queue(2);
    queue.add([&done] { ++done; });
    const auto add_all = [&] {
        queue.add([] { throw std::runtime_error("first"); });
        for (int i = 0; i < 9; ++i) {
            queue.add([&done] {
                ++done;
                throw std::runtime_error("second");
            });
        }
    };
    EXPECT_THROW(add_all(), std::runtime_error);
    try {
        queue.finish();
        FAIL();
    } catch (const std::runtime_error& error) {
        EXPECT_STREQ(error.what(), "first");
    }
    EXPECT_EQ(done, 1);
}

TEST(OutputQueue, FinishesItsTasksWhenItIsDestroyed) {
    std::atomic<int> done = 0;
    {
        OutputQueue queue(2);
        for (int i = 0; i < 2; ++i) queue.add([&done] { ++done; });
    }
    EXPECT_EQ(done, 2);
    OutputQueue with_error(2);
    with_error.add([] { throw std::runtime_error("lost"); });
}

}  // namespace
}  // namespace mray::app
