// The cost of a scene's queries since the last update, for policies that weigh it.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>

#include "common/base/stopwatch.h"
#include "library/thread_index.h"

namespace morphray::detail {

/// Threads may add at the same time. Rays are counted exactly, by any threads in any order, so that
/// deterministic policies decide by them.
class QueryCost {
public:
    void add(double ms, std::uint64_t rays) {
        add_time(ms);
        rays_.fetch_add(rays, std::memory_order_relaxed);
    }
    /// Calls `query`, which traces one ray. One call of kSample is timed and stands for all: a
    /// clock costs as much as a ray.
    template <class Query>
    void sample(Query query) {
        constexpr std::uint64_t kSample = 64;
        if (count_call() % kSample != 0) {
            query();
            return;
        }
        const mray::Stopwatch watch;
        query();
        add_time(watch.ms() * kSample);
    }

    double ms() const {
        return static_cast<double>(nanoseconds_.load(std::memory_order_relaxed)) * 1e-6;
    }
    /// No other thread may add at the same time.
    std::uint64_t rays() const {
        return rays_.load(std::memory_order_relaxed) + calls() - calls_before_;
    }
    /// As rays().
    void reset() {
        nanoseconds_ = 0;
        rays_ = 0;
        calls_before_ = calls();
    }

private:
    struct alignas(64) Counter {
        std::atomic<std::uint64_t> calls = 0;
    };

    void add_time(double ms) {
        nanoseconds_.fetch_add(static_cast<std::uint64_t>(ms * 1e6), std::memory_order_relaxed);
    }
    /// Returns the number of calls under this thread's index, this one included.
    std::uint64_t count_call() {
        const std::uint32_t index = thread_index();
        std::atomic<std::uint64_t>& calls = counters_[index].calls;
        if (index == kIndexedThreads) return calls.fetch_add(1, std::memory_order_relaxed) + 1;
        // No other thread writes here, and a load and a store cost less than an atomic addition.
        const std::uint64_t count = calls.load(std::memory_order_relaxed) + 1;
        calls.store(count, std::memory_order_relaxed);
        return count;
    }
    std::uint64_t calls() const {
        std::uint64_t sum = 0;
        for (const Counter& counter : counters_)
            sum += counter.calls.load(std::memory_order_relaxed);
        return sum;
    }

    std::atomic<std::uint64_t> nanoseconds_ = 0;
    std::atomic<std::uint64_t> rays_ = 0;
    /// calls() at the last reset(). Counters go on, so that scenes with few queries a pose are
    /// sampled, too.
    std::uint64_t calls_before_ = 0;
    /// Single rays by thread_index().
    std::array<Counter, kIndexedThreads + 1> counters_;
};

}  // namespace morphray::detail
