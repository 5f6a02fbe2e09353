// Divides rays and points among threads, or among submissions to a device.
#pragma once

#include <tbb/blocked_range.h>

#include "common/base/watch.h"
#include "library/src/scene_impl.h"

namespace morphray::detail {

/// Batches up to this size are traced in the calling thread; waking other threads takes longer.
inline constexpr std::size_t kFewRays = 256;
/// Rays that are converted and traced together, in memory on the stack.
inline constexpr std::size_t kRun = mray::cpu::SceneRays::kMost;
/// The first run of a thread where the caller may cancel: half a stream.
inline constexpr std::size_t kLeastRun = 32;
/// The first submission where the caller may cancel: a workgroup.
inline constexpr std::size_t kLeastDeviceRun = 64;

/// Calls `work(first, count)` for runs of at most `most` of the rays [begin, end), until the watch
/// is cancelled. If it can be and `least` > 0, runs begin with `least` rays and then take some ms.
template <class Work>
void for_runs_of(std::size_t begin, std::size_t end, mray::Watch watch, Work work,
                 std::size_t most = kRun, std::size_t least = 0) {
    constexpr double kWantedMs = 4;
    const bool is_timed = least != 0 && watch.can_cancel();
    for (std::size_t size = is_timed ? least : most; begin < end && !watch.is_cancelled();) {
        const std::size_t count = std::min(size, end - begin);
        std::optional<mray::Stopwatch> clock;
        if (is_timed) clock.emplace();
        work(begin, count);
        begin += count;
        if (!clock) continue;
        const double wanted = static_cast<double>(count) * kWantedMs / std::max(clock->ms(), 1e-3);
        size = std::clamp(static_cast<std::size_t>(wanted), least, most);
    }
}

/// The same for the rays [0, total), in this thread if `arena` is null or they are few.
template <class Work>
void for_each_run(mray::ThreadArena* arena, std::size_t total, mray::Watch watch, Work work,
                  std::size_t most = kRun) {
    if (arena == nullptr || total <= kFewRays) {
        for_runs_of(0, total, watch, work, most, kLeastRun);
        return;
    }
    using RayRange = tbb::blocked_range<std::size_t>;
    arena->execute([&] {
        tbb::parallel_for(RayRange(0, total, kRun), [&](const RayRange& range) {
            for_runs_of(range.begin(), range.end(), watch, work, most, kLeastRun);
        });
    });
}

/// Calls work(first, rays, order) for batches of the rays from `first` on, until it is cancelled.
/// If `sorts` and that pays, `order` numbers the rays of the batch so that neighbours are alike.
template <class Work>
void for_ordered_batches(SceneImpl& scene, std::span<const Ray> rays, bool sorts, std::size_t most,
                         mray::ThreadArena* arena, mray::Watch watch, Work work) {
    constexpr std::size_t kLeastSorted = 8192;
    const auto run = [&](RaySorter* sorter) {
        const auto work_on = [&](std::size_t first, std::size_t count) {
            const std::span<const Ray> batch = rays.subspan(first, count);
            std::span<const std::uint32_t> order;
            if (sorter != nullptr) order = sorter->sort(batch, scene.target(), arena);
            work(first, batch, order);
        };
        for_runs_of(0, rays.size(), watch, work_on, most);
    };
    if (!sorts || rays.size() < kLeastSorted || !scene.tracer().info().is_on_processor)
        return run(nullptr);
    scene.sorter.use([&](RaySorter& sorter) {
        sorter.choose_curve(rays, scene.space().extent());
        run(&sorter);
    });
}

/// Calls query(first, count), which checks the watch, for parts of [0, total) in the host's
/// threads. Throws mray::Error(kCancelled).
template <class Query>
void query_on_host(SceneImpl& scene, std::size_t total, const QueryOptions& options, Query query) {
    // Enough for streams of each octant of directions.
    constexpr std::size_t kBatch = 2048;
    mray::ThreadArena* const arena = options.threads == Threads::calling ? nullptr : &scene.arena();
    scene.cost.measure(total, [&] { for_each_run(arena, total, {}, query, kBatch); });
    mray::Watch(options.cancel).throw_if_cancelled();
}

/// The same where the tracer answers, on a device one part after the other.
template <class Query>
void query_tracer(SceneImpl& scene, std::size_t total, const QueryOptions& options, Query query) {
    if (scene.tracer().info().answers_threads) return query_on_host(scene, total, options, query);
    constexpr std::size_t kBatch = std::size_t{1} << 16;
    const mray::Watch watch(options.cancel);
    const mray::Stopwatch stopwatch;
    const auto query_alone = [&](std::size_t first, std::size_t count) {
        const std::scoped_lock lock(scene.mutex());
        query(first, count);
    };
    for_runs_of(0, total, watch, query_alone, kBatch, kLeastDeviceRun);
    scene.cost.add(stopwatch.ms(), total);
    watch.throw_if_cancelled();
}

}  // namespace morphray::detail
