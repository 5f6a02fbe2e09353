// Many rays in runs, which threads share.
#pragma once

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <cstddef>

#include "common/base/thread_arena.h"
#include "common/base/watch.h"
#include "cpu/scene_space/to_scene.h"

namespace morphray::detail {

/// Batches up to this size are traced in the calling thread; waking other threads takes longer.
inline constexpr std::size_t kFewRays = 256;
/// Rays that are converted and traced together, in memory on the stack.
inline constexpr std::size_t kRun = mray::cpu::SceneRays::kMost;

inline bool is_cancelled(const std::atomic<bool>* cancel) {
    return mray::Watch(cancel).is_cancelled();
}
inline void throw_if_cancelled(const std::atomic<bool>* cancel) {
    mray::Watch(cancel).throw_if_cancelled();
}

/// Calls `work(i)` for each i below `count`, in this thread if `arena` is null.
template <class Work>
void for_each_index(mray::ThreadArena* arena, std::size_t count, const Work& work) {
    if (arena == nullptr) {
        for (std::size_t i = 0; i < count; ++i) work(i);
    } else {
        arena->execute([&] { tbb::parallel_for(std::size_t{0}, count, work); });
    }
}

/// Calls `work(first, count)` for runs of at most `most` of the rays [begin, end), until `cancel`
/// is true; null: for all of them.
template <class Work>
void for_runs_of(std::size_t begin, std::size_t end, const std::atomic<bool>* cancel, Work work,
                 std::size_t most = kRun) {
    for (; begin < end && !is_cancelled(cancel); begin += most)
        work(begin, std::min(most, end - begin));
}

/// The same for the rays [0, total), in this thread if `arena` is null or they are few.
template <class Work>
void for_each_run(mray::ThreadArena* arena, std::size_t total, const std::atomic<bool>* cancel,
                  Work work, std::size_t most = kRun) {
    if (arena == nullptr || total <= kFewRays) {
        for_runs_of(0, total, cancel, work, most);
        return;
    }
    using Range = tbb::blocked_range<std::size_t>;
    arena->execute([&] {
        tbb::parallel_for(Range(0, total, kRun), [&](const Range& range) {
            for_runs_of(range.begin(), range.end(), cancel, work, most);
        });
    });
}

}  // namespace morphray::detail
