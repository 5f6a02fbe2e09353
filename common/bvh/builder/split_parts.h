// Data of a split that pass between its steps.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>

#include "common/bvh/box.h"
#include "common/bvh/builder/prim_ref.h"

namespace mray {

/// The cheapest place found so far.
struct Split {
    float cost = std::numeric_limits<float>::infinity();
    int axis = 0;
    std::size_t position = 0;
    std::size_t left_size = 0;

    void consider(const Split& other) {
        if (other.cost < cost) *this = other;
    }
};

// The cost of the node that a part is in, in triangle tests. Trees come out 0.4 to 2 % cheaper than
// with 0; still more makes cheaper ones, but of smaller leaves (lab/notes/build_and_refit.md).
inline constexpr float kPartCost = 12;

/// Maps twice a centroid to its bin along each axis: (centroid2 - lower) * scale, clamped to
/// [0, bins - 1] and rounded down. Lane 3 is 0. All refs that do not differ along an axis are in
/// its first bin.
struct Binning {
    /// bounds: those of twice the centroids.
    Binning(const Box& bounds, std::size_t bins) {
        for (int axis = 0; axis < 3; ++axis) {
            lower[axis] = bounds.lower[axis];
            const float extent = bounds.upper[axis] - bounds.lower[axis];
            // A hair less than `bins`, so that the largest centroid falls into the last bin.
            if (extent > 0) scale[axis] = static_cast<float>(bins) * 0.9999f / extent;
        }
    }

    alignas(16) float lower[4] = {};
    alignas(16) float scale[4] = {};
};

/// The triangles in a bin of each axis. The size is a power of two, which makes for a fast address.
struct alignas(32) Bin {
    /// The union of the boxes, as in PrimRef.
    float planes[3][8];
    /// Triangles for each axis; count[3] is 0.
    std::int32_t count[4];
};

template <std::size_t kBins>
struct Bins {
    Bin bin[kBins];

    std::size_t count_below(std::size_t position, int axis) const {
        std::size_t sum = 0;
        for (std::size_t i = 0; i < position; ++i)
            sum += static_cast<std::uint32_t>(bin[i].count[axis]);
        return sum;
    }
};

// Bins an axis for sets that are split in chunks, where bins take little of the time, and for
// others: more than 16 would make the build 7 % slower and the tree no better
// (lab/notes/build_and_refit.md).
inline constexpr std::size_t kManyBins = 32;
inline constexpr std::size_t kFewBins = 16;
using ManyBins = Bins<kManyBins>;
using FewBins = Bins<kFewBins>;

}  // namespace mray
