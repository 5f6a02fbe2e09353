// What the queries since the last update have cost, for policies that weigh it.
#pragma once

#include <atomic>
#include <cstdint>

#include "common/base/stopwatch.h"

namespace morphray::detail {

/// Threads may add at the same time.
class QueryCost {
public:
    void add(double ms, std::uint64_t rays) {
        nanoseconds_.fetch_add(static_cast<std::uint64_t>(ms * 1e6), std::memory_order_relaxed);
        rays_.fetch_add(rays, std::memory_order_relaxed);
    }
    /// Calls `query`, which traces few rays. One call of kSample is timed and stands for all: a
    /// clock costs as much as a ray.
    template <class Query>
    void sample(std::uint64_t rays, Query query) {
        constexpr std::uint32_t kSample = 64;
        thread_local std::uint32_t calls = 0;
        if (++calls % kSample != 0) {
            query();
            return;
        }
        const mray::Stopwatch watch;
        query();
        add(watch.ms() * kSample, rays * kSample);
    }

    double ms() const {
        return static_cast<double>(nanoseconds_.load(std::memory_order_relaxed)) * 1e-6;
    }
    std::uint64_t rays() const { return rays_.load(std::memory_order_relaxed); }
    void reset() {
        nanoseconds_ = 0;
        rays_ = 0;
    }

private:
    std::atomic<std::uint64_t> nanoseconds_ = 0;
    std::atomic<std::uint64_t> rays_ = 0;
};

}  // namespace morphray::detail
