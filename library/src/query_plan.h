// How the rays and points of a call are divided: among threads, into calls of the tracer, and in
// which order; and what that costs.
#pragma once

#include <tbb/blocked_range.h>

#include "common/watched_runs.h"
#include "library/src/query_filter.h"

namespace morphray::detail {

/// Batches up to this size are traced in the calling thread; waking other threads takes longer.
inline constexpr std::size_t kFewRays = 256;
/// Rays that are converted and traced together, in memory on the stack.
inline constexpr std::size_t kRun = mray::cpu::SceneRays::kMost;

/// Calls work(first, count) for runs of at most `most` of the rays [begin, end), until the watch is
/// cancelled. If it can be, the first run of a thread is half a stream.
template <class Work>
void for_runs_of(std::size_t begin, std::size_t end, mray::Watch watch, Work work,
                 std::size_t most = kRun) {
    constexpr std::size_t kLeastRun = 32;
    mray::for_watched_runs(begin, end, watch, most, kLeastRun, work);
}

/// As for_runs_of(0, total, ...), in many threads unless `arena` is null or rays are few.
template <class Work>
void for_each_run(mray::ThreadArena* arena, std::size_t total, mray::Watch watch, Work work,
                  std::size_t most = kRun) {
    if (arena == nullptr || total <= kFewRays) return for_runs_of(0, total, watch, work, most);
    using RayRange = tbb::blocked_range<std::size_t>;
    arena->execute([&] {
        tbb::parallel_for(RayRange(0, total, kRun), [&](const RayRange& range) {
            for_runs_of(range.begin(), range.end(), watch, work, most);
        });
    });
}

/// Calls work(first, rays, order) for batches of the rays from `first` on, until it is cancelled.
/// If the caller says that they come in any order, and sorting pays, `order` numbers the rays of
/// the batch so that neighbours are alike.
template <class Work>
void for_ordered_batches(SceneImpl& scene, std::span<const Ray> rays, const QueryOptions& options,
                         std::size_t most, mray::ThreadArena* arena, Work work) {
    constexpr std::size_t kLeastSorted = 8192;
    const auto run = [&](RaySorter* sorter) {
        const auto work_on = [&](std::size_t first, std::size_t count) {
            const std::span<const Ray> batch = rays.subspan(first, count);
            std::span<const std::uint32_t> order;
            if (sorter != nullptr) order = sorter->sort(batch, scene.target(), arena);
            work(first, batch, order);
        };
        mray::for_watched_runs(0, rays.size(), mray::Watch(options.cancel), most, 0, work_on);
    };
    if (options.coherence.kind != Coherence::Kind::sort || rays.size() < kLeastSorted ||
        !scene.tracer().info().is_on_processor)
        return run(nullptr);
    scene.sorter.use([&](RaySorter& sorter) {
        sorter.choose_curve(rays, scene.space().extent());
        run(&sorter);
    });
}

/// Calls work(first, count), which asks queries of this type, for parts of [0, total): in many
/// threads, or in this one where calls should be large. Throws mray::Error(kCancelled).
template <class Query, class Work>
void for_query_parts(SceneImpl& scene, std::size_t total, QueryFilter& filter, Work work) {
    // Enough for streams of each octant of directions.
    constexpr std::size_t kBatch = 2048;
    const std::size_t call_size = filter.prepare<Query>();
    const bool is_alone = filter.options().threads == Threads::calling || call_size > kBatch;
    mray::ThreadArena* const arena = is_alone ? nullptr : &scene.arena();
    scene.cost.measure(total,
                       [&] { for_each_run(arena, total, {}, work, std::max(kBatch, call_size)); });
    filter.watch().throw_if_cancelled();
}

}  // namespace morphray::detail
