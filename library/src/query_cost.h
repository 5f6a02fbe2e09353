// The cost of a scene's queries since the last update, for policies.
#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <cstddef>

#include "common/frame_times.h"

namespace morphray::detail {

/// Threads may add at the same time. Rays are counted exactly, for deterministic policies.
class QueryCost {
public:
    void add(double ms, std::uint64_t rays) {
        add_time(ms);
        count_rays(rays);
    }
    /// Marks rays that are counted elsewhere as those of an image, which packets trace.
    void mark_image(std::uint64_t rays) { image_rays_.fetch_add(rays, std::memory_order_relaxed); }
    void add_image(double ms, std::uint64_t rays) {
        add(ms, rays);
        mark_image(rays);
    }
    /// Calls `query`, which traces this many rays. A clock costs as much as a ray, so one in some
    /// kSample rays of small calls is timed.
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
    std::uint64_t rays() const { return counted() - counted_before_; }
    /// The part of rays() that images traced. No other thread may add at the same time.
    std::uint64_t image_rays() const { return image_rays_.load(std::memory_order_relaxed); }
    void reset() {
        nanoseconds_ = 0;
        image_rays_ = 0;
        counted_before_ = counted();
    }

private:
    struct alignas(64) Counter {
        std::atomic<std::uint64_t> rays = 0;
    };
    static constexpr std::size_t kCounters = 64;

    void add_time(double ms) {
        nanoseconds_.fetch_add(static_cast<std::uint64_t>(ms * 1e6), std::memory_order_relaxed);
    }
    /// Returns the number of rays in this thread's counter, these included.
    std::uint64_t count_rays(std::uint64_t rays) {
        // Threads that share a cache line would wait for each other.
        static constinit std::atomic<std::size_t> threads = 0;
        thread_local const std::size_t index =
            threads.fetch_add(1, std::memory_order_relaxed) % kCounters;
        return counters_[index].rays.fetch_add(rays, std::memory_order_relaxed) + rays;
    }
    std::uint64_t counted() const {
        std::uint64_t sum = 0;
        for (const Counter& counter : counters_)
            sum += counter.rays.load(std::memory_order_relaxed);
        return sum;
    }

    std::atomic<std::uint64_t> nanoseconds_ = 0;
    std::atomic<std::uint64_t> image_rays_ = 0;
    /// counted() at the last reset(). Counters go on, so that few queries a pose are sampled, too.
    std::uint64_t counted_before_ = 0;
    std::array<Counter, kCounters> counters_;
};

}  // namespace morphray::detail
