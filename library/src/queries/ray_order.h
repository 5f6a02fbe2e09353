// Rays in an order in which neighbours are alike.
#pragma once

#include <tbb/parallel_for.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <span>

#include "common/base/aligned_vector.h"
#include "common/base/thread_arena.h"
#include "cpu/scene_space/ray_keys.h"
#include "morphray/geometry.hpp"
#include "morphray/queries.hpp"

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

/// Fewer rays gain nothing from being sorted.
inline constexpr std::size_t kLeastSorted = 8192;

inline bool is_to_sort(std::span<const Ray> rays, Coherence coherence) {
    return coherence.kind == Coherence::Kind::sort && rays.size() >= kLeastSorted;
}

/// The rays of a tile of an image are a stream (cpu/single_ray/ray_stream-inl.h).
inline constexpr std::size_t kTileSide = 8;

inline bool is_image(Coherence coherence) {
    return coherence.kind == Coherence::Kind::image && coherence.width >= kTileSide;
}

/// Orders `total` rays, those of an image with rows of `width`, tile after tile, and the rays below
/// the tiles last. Sets places[i] to the index of ray begin + i in this order, a permutation.
void find_tiled_places(std::size_t width, std::size_t total, std::size_t begin,
                       std::span<std::size_t> places);

/// A curve along which neighbours are alike, made from samples of the rays; there is at least one.
/// `extent` is half of the longest side of the scene: origins at this distance are as far from each
/// other as directions at a distance of 1 on the octahedron.
mray::cpu::RayCurve curve_of(std::span<const Ray> rays, double extent);

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
