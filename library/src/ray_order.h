// An order of many rays or points in which neighbours are alike.
#pragma once

#include <tbb/parallel_for.h>

#include <mutex>

#include "common/base/aligned_vector.h"
#include "common/base/thread_arena.h"
#include "common/scene/scene_space.h"
#include "cpu/scene_space/ray_keys.h"
#include "morphray/geometry.hpp"

namespace morphray::detail {

/// Sorts rays along a curve. Keeps its memory, since new memory takes longer. Not thread-safe.
class RaySorter {
public:
    /// Rays that are sorted at a time; more at a time gain little.
    static constexpr std::size_t kMost = std::size_t{1} << 20;

    /// Chooses a curve from samples of the rays, at least one. Origins `extent` apart, half of the
    /// longest side of the scene, count as much as directions 1 apart on the octahedron.
    void choose_curve(std::span<const Ray> rays, double extent);

    /// The indices of at most kMost rays, stably sorted by their keys; valid until the next call.
    /// Runs in this thread if `arena` is null.
    std::span<const std::uint32_t> sort(std::span<const Ray> rays, const mray::SimdTarget& target,
                                        mray::ThreadArena* arena);

private:
    mray::cpu::RayCurve curve_;
    mray::AlignedVector<std::uint16_t> keys_;
    // By the upper half of keys: their lower half in the upper 8 bits, and the ray's index.
    mray::AlignedVector<std::uint32_t> items_;
    mray::AlignedVector<std::uint32_t> places_;
};

/// A sorter for many threads: one that finds it in use makes its own.
class SharedRaySorter {
public:
    template <class Use>
    void use(Use use) {
        const std::unique_lock lock(mutex_, std::try_to_lock);
        std::optional<RaySorter> own;
        use(lock ? sorter_ : own.emplace());
    }

private:
    std::mutex mutex_;
    RaySorter sorter_;
};

enum class PointOrder {
    places,   // neighbours are near each other
    columns,  // neighbours are above each other, along z
};

/// A permutation of at most 2^32 points along a Morton curve over their bounds (G. M. Morton. A
/// Computer Oriented Geodetic Data Base. IBM, 1966). Those far from the scene come anywhere.
std::vector<std::uint32_t> order_points(std::span<const Vec3> points,
                                        const mray::WorldBounds& scene, PointOrder by);

/// The places of an image's rays tile after tile, which are streams; rows have `width` rays.
std::vector<std::uint32_t> tiled_places(std::size_t width, std::size_t total);

/// Calls `work(i)` for each i below `count`, in this thread if `arena` is null.
template <class Work>
void for_each_index(mray::ThreadArena* arena, std::size_t count, const Work& work) {
    if (arena == nullptr) {
        for (std::size_t i = 0; i < count; ++i) work(i);
    } else {
        arena->execute([&] { tbb::parallel_for(std::size_t{0}, count, work); });
    }
}

}  // namespace morphray::detail
