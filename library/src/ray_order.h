// Many rays and points: an order in which neighbours are alike, and runs that threads share.
#pragma once

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "common/base/aligned_vector.h"
#include "common/base/thread_arena.h"
#include "common/base/watch.h"
#include "common/frame_times.h"
#include "cpu/scene_space/ray_keys.h"
#include "cpu/scene_space/to_scene.h"
#include "morphray/geometry.hpp"

namespace morphray::detail {

/// Sorts rays along a curve. Keeps its memory, since new memory takes longer. Not thread-safe.
class RaySorter {
public:
    /// Rays that are sorted at a time; more at a time gain little.
    static constexpr std::size_t kMost = std::size_t{1} << 20;

    /// Chooses a curve along which neighbours are alike, from samples of the rays; there is at
    /// least one. `extent` is half of the longest side of the scene: origins at this distance are
    /// as far from each other as directions at a distance of 1 on the octahedron.
    void choose_curve(std::span<const Ray> rays, double extent);

    /// The indices of at most kMost rays in the order of their keys, rays of one key in their
    /// order. Valid until the next call. Runs in this thread if `arena` is null.
    std::span<const std::uint32_t> sort(std::span<const Ray> rays, const mray::SimdTarget& target,
                                        mray::ThreadArena* arena);

private:
    mray::cpu::RayCurve curve_;
    mray::AlignedVector<std::uint16_t> keys_;
    // Rays by the upper half of their keys: the lower half in the upper 8 bits, and the index.
    mray::AlignedVector<std::uint32_t> items_;
    mray::AlignedVector<std::uint32_t> places_;
};

/// Which points are neighbours.
enum class PointOrder {
    places,   // those near each other
    columns,  // those above each other, along z
};

/// A permutation of the points: along a Morton curve over their bounds (G. M. Morton. A Computer
/// Oriented Geodetic Data Base. IBM, 1966). Points with a component that is not finite come
/// somewhere. At most 2^32 points.
std::vector<std::uint32_t> order_points(std::span<const mray::vec3> points, PointOrder by);

/// Batches up to this size are traced in the calling thread; waking other threads takes longer.
inline constexpr std::size_t kFewRays = 256;
/// Rays that are converted and traced together, in memory on the stack.
inline constexpr std::size_t kRun = mray::cpu::SceneRays::kMost;
/// The first run of a thread where the caller may cancel: half a stream.
inline constexpr std::size_t kLeastRun = 32;

/// Calls `work(i)` for each i below `count`, in this thread if `arena` is null.
template <class Work>
void for_each_index(mray::ThreadArena* arena, std::size_t count, const Work& work) {
    if (arena == nullptr) {
        for (std::size_t i = 0; i < count; ++i) work(i);
    } else {
        arena->execute([&] { tbb::parallel_for(std::size_t{0}, count, work); });
    }
}

/// Calls `work(first, count)` for runs of at most `most` of the rays [begin, end), until the watch
/// is cancelled. If it can be, and `least` is not 0, the first run is so long, and the others take
/// some milliseconds.
template <class Work>
void for_runs_of(std::size_t begin, std::size_t end, mray::Watch watch, Work work,
                 std::size_t most = kRun, std::size_t least = 0) {
    constexpr double kWantedMs = 4;
    const bool is_timed = least != 0 && watch.can_cancel();
    for (std::size_t size = is_timed ? least : most; begin < end && !watch.is_cancelled();) {
        const std::size_t count = std::min(size, end - begin);
        const mray::Stopwatch clock;
        work(begin, count);
        begin += count;
        if (!is_timed) continue;
        const double wanted = static_cast<double>(count) * kWantedMs / std::max(clock.ms(), 1e-3);
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
    using Range = tbb::blocked_range<std::size_t>;
    arena->execute([&] {
        tbb::parallel_for(Range(0, total, kRun), [&](const Range& range) {
            for_runs_of(range.begin(), range.end(), watch, work, most, kLeastRun);
        });
    });
}

}  // namespace morphray::detail
