// The cost of a scene's queries since the last update, for policies that weigh it.
#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdint>

#include "common/base/stopwatch.h"
#include "library/src/queries/thread_index.h"

namespace morphray::detail {

/// Threads may add at the same time. Rays are counted exactly, by any threads in any order, so that
/// deterministic policies decide by them.
class QueryCost {
public:
    void add(double ms, std::uint64_t rays) {
        add_time(ms);
        rays_.fetch_add(rays, std::memory_order_relaxed);
    }
    /// Calls `query`, which traces this many rays. Of calls with fewer than kSample rays, the one
    /// with every kSample-th ray of this thread is timed and stands for kSample rays: a clock costs
    /// as much as a ray.
    template <class Query>
    void measure(std::uint64_t rays, Query query) {
        constexpr std::uint64_t kSample = 64;
        const std::uint64_t count = count_rays(rays);
        if (count / kSample == (count - rays) / kSample) {
            query();
            return;
        }
        const mray::Stopwatch watch;
        query();
        const double shown = static_cast<double>(std::max(rays, kSample));
        add_time(watch.ms() * (shown / static_cast<double>(rays)));
    }

    double ms() const {
        return static_cast<double>(nanoseconds_.load(std::memory_order_relaxed)) * 1e-6;
    }
    /// No other thread may add at the same time.
    std::uint64_t rays() const {
        return rays_.load(std::memory_order_relaxed) + measured() - measured_before_;
    }
    /// As rays().
    void reset() {
        nanoseconds_ = 0;
        rays_ = 0;
        measured_before_ = measured();
    }

private:
    struct alignas(64) Counter {
        std::atomic<std::uint64_t> rays = 0;
    };

    void add_time(double ms) {
        nanoseconds_.fetch_add(static_cast<std::uint64_t>(ms * 1e6), std::memory_order_relaxed);
    }
    /// Returns the number of rays under this thread's index, these included.
    std::uint64_t count_rays(std::uint64_t rays) {
        const std::uint32_t index = thread_index();
        std::atomic<std::uint64_t>& counter = counters_[index].rays;
        if (index == kIndexedThreads)
            return counter.fetch_add(rays, std::memory_order_relaxed) + rays;
        // No other thread writes here, and a load and a store cost less than an atomic addition.
        const std::uint64_t count = counter.load(std::memory_order_relaxed) + rays;
        counter.store(count, std::memory_order_relaxed);
        return count;
    }
    /// All rays of measure().
    std::uint64_t measured() const {
        std::uint64_t sum = 0;
        for (const Counter& counter : counters_)
            sum += counter.rays.load(std::memory_order_relaxed);
        return sum;
    }

    std::atomic<std::uint64_t> nanoseconds_ = 0;
    std::atomic<std::uint64_t> rays_ = 0;
    /// measured() at the last reset(). Counters go on, so that scenes with few queries a pose are
    /// sampled, too.
    std::uint64_t measured_before_ = 0;
    /// Rays by thread_index().
    std::array<Counter, kIndexedThreads + 1> counters_;
};

}  // namespace morphray::detail
