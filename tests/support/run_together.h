// Calls at the same time.
#pragma once

#include <cstddef>
#include <functional>
#include <latch>
#include <thread>
#include <vector>

namespace mray::test {

/// Calls all of these at the same time, each in a thread of its own, and returns when all have.
inline void run_together(const std::vector<std::function<void()>>& works) {
    std::latch start(static_cast<std::ptrdiff_t>(works.size()));
    std::vector<std::thread> threads;
    for (const std::function<void()>& work : works) {
        threads.emplace_back([&] {
            start.arrive_and_wait();
            work();
        });
    }
    for (std::thread& thread : threads) thread.join();
}

/// The same for work(0), work(1), ... of this many threads.
template <class Work>
void run_together(std::size_t threads, Work work) {
    std::vector<std::function<void()>> works;
    for (std::size_t i = 0; i < threads; ++i) works.emplace_back([&work, i] { work(i); });
    run_together(works);
}

}  // namespace mray::test
