// Many rays in runs, which threads share.
#pragma once

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cstddef>

#include "common/base/thread_arena.h"
#include "library/queries/ray_space.h"

namespace morphray::detail {

/// Batches up to this size are traced in the calling thread; waking other threads takes longer.
inline constexpr std::size_t kFewRays = 256;
/// Rays that are converted and traced together, in memory on the stack.
inline constexpr std::size_t kRun = RaySpace::kMost;

/// Calls `work(first, count)` for runs of at most kRun of the rays [begin, end).
template <class Work>
void for_runs_of(std::size_t begin, std::size_t end, Work work) {
    for (; begin < end; begin += kRun) work(begin, std::min(kRun, end - begin));
}

/// Calls `work(first, count)` for runs of at most kRun of `total` rays, in this thread or in many.
template <class Work>
void for_each_run(std::size_t total, mray::ThreadArena& arena, Work work) {
    if (total <= kFewRays) {
        for_runs_of(0, total, work);
        return;
    }
    using Range = tbb::blocked_range<std::size_t>;
    arena.execute([&] {
        tbb::parallel_for(Range(0, total, kRun), [&](const Range& range) {
            for_runs_of(range.begin(), range.end(), work);
        });
    });
}

}  // namespace morphray::detail
