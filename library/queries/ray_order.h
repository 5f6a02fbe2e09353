// Rays in an order in which neighbours are alike.
#pragma once

#include <tbb/parallel_for.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <span>

#include "common/base/aligned_vector.h"
#include "common/base/thread_arena.h"
#include "cpu/scene_space/ray_keys.h"
#include "library/queries/ray_space.h"
#include "morphray/geometry.hpp"

namespace morphray::detail {

/// Calls work(i) for each i below `count`, in this thread if `arena` is null.
template <class Work>
void for_each_part(mray::ThreadArena* arena, std::size_t count, const Work& work) {
    if (arena == nullptr) {
        for (std::size_t i = 0; i < count; ++i) work(i);
    } else {
        arena->execute([&] { tbb::parallel_for(std::size_t{0}, count, work); });
    }
}

/// The curve of a batch of rays.
class RayOrder {
public:
    /// Fewer rays gain nothing.
    static constexpr std::size_t kLeast = 8192;

    /// `extent` is half of the longest side of the scene: the length at which origins are as far
    /// from each other as directions are at a distance of 1 on the octahedron. Reads some of the
    /// rays, at least kLeast.
    RayOrder(std::span<const Ray> rays, double extent);

    /// Whether neighbours in the batch are not alike already, as those of an image are, or all
    /// rays. A guess from samples.
    bool is_needed() const { return is_needed_; }

    const mray::cpu::RayCurve& curve() const { return curve_; }

private:
    mray::cpu::RayCurve curve_;
    bool is_needed_ = false;
};

/// The curve to sort rays along; nothing if they are few, or their neighbours are alike already.
std::optional<mray::cpu::RayCurve> curve_to_sort(std::span<const Ray> rays, const RaySpace& space);

/// Sorts rays. Keeps its memory, 10 bytes for each of the most rays so far. Not thread-safe.
class RaySorter {
public:
    /// Rays that are sorted at a time; more at a time gain little.
    static constexpr std::size_t kMost = std::size_t{1} << 20;

    /// Makes room for as many rays, up to kMost. Throws std::bad_alloc.
    void make_room(std::size_t rays);

    /// The indices of all rays, for which there must be room, in the order of their keys, rays of
    /// one key in their order. Valid until the next call. Runs in this thread if `arena` is null.
    std::span<const std::uint32_t> sort(std::span<const Ray> rays, const mray::cpu::RayKeys& keys,
                                        mray::ThreadArena* arena);

private:
    mray::AlignedVector<std::uint16_t> keys_;
    // Rays by the upper half of their keys: the lower half in the upper 8 bits, and the index.
    mray::AlignedVector<std::uint32_t> items_;
    mray::AlignedVector<std::uint32_t> places_;
};

/// Keeps a sorter for the next batch, since new memory takes longer than sorting. Threads may share
/// one.
class RaySorterStore {
public:
    /// Returns the kept sorter, or a new one.
    std::unique_ptr<RaySorter> take();
    void keep(std::unique_ptr<RaySorter> sorter);

private:
    std::mutex mutex_;
    std::unique_ptr<RaySorter> kept_;
};

}  // namespace morphray::detail
