// Rays and points in an order in which neighbours are alike.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "common/base/aligned_vector.h"
#include "common/base/thread_arena.h"
#include "cpu/scene_space/ray_keys.h"
#include "morphray/geometry.hpp"

namespace morphray::detail {

/// Sorts rays along a curve. Keeps its memory, 10 bytes for each of the most rays so far, since new
/// memory takes longer than sorting. Not thread-safe.
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

}  // namespace morphray::detail
