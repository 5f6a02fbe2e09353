// A set of triangles as the builder sees it, and choosing where to divide it.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>

#include "common/bvh/box.h"
#include "common/scene/mesh.h"
#include "common/simd/simd_target.h"

namespace mray {

/// The box and the id of a triangle (or of a part of a tree, see build_binary_tree), as eight
/// floats: lower x y z, id, -upper x y z, 0. The union of two boxes is then one minimum. The id
/// is stored as the bits of a float in [2, 2^33). So arithmetic on all eight floats at once is
/// never slowed down by a denormal number or a NaN. A pair has the box of two triangles, prim_id()
/// and the one after it, and ends in kPair.
struct alignas(32) PrimRef {
    float planes[8];

    static constexpr std::uint32_t kIdBits = 0x40000000;
    static constexpr float kPair = 2.0f;

    PrimRef() = default;
    PrimRef(const Box& box, std::uint32_t prim_id)
        : planes{box.lower.x,  box.lower.y,  box.lower.z,  std::bit_cast<float>(kIdBits | prim_id),
                 -box.upper.x, -box.upper.y, -box.upper.z, 0} {}

    std::uint32_t prim_id() const { return std::bit_cast<std::uint32_t>(planes[3]) ^ kIdBits; }
    /// 1, or 2 for a pair. Reads bits, without a branch.
    std::uint32_t triangle_count() const {
        static_assert(std::bit_cast<std::uint32_t>(kPair) == 1u << 30);
        return 1 + (std::bit_cast<std::uint32_t>(planes[7]) >> 30);
    }
    Box box() const {
        return {{planes[0], planes[1], planes[2]}, {-planes[4], -planes[5], -planes[6]}};
    }
    /// Whether the box is Box(). Compares bits, in one instruction.
    bool empty() const {
        return std::bit_cast<std::uint32_t>(planes[0]) == std::bit_cast<std::uint32_t>(kEmptyPlane);
    }
    /// Twice the centroid of the box, rounded once; 0 for an empty one.
    float centroid2(int axis) const { return planes[axis] - planes[4 + axis]; }
};

/// Sets the refs of the triangles first .. first + refs.size() - 1, whose boxes leave out vertices
/// that are not finite. positions has one entry for each vertex of the topology.
void make_refs(const Topology& topology, std::span<const vec3> positions, std::uint32_t first,
               std::span<PrimRef> refs, const SimdTarget& target = best_simd_target());

/// The union of the boxes of the refs; empty for none.
Box union_of(std::span<const PrimRef> refs, const SimdTarget& target = best_simd_target());

/// The bounds of twice the centroids of those refs that are not empty; empty for none.
Box centroid_bounds(std::span<const PrimRef> refs, const SimdTarget& target = best_simd_target());

/// Makes pairs of neighbours in the list that share one edge and whose common box is small; the
/// others stay as they are. refs are triangles of the topology, each the one after the last.
/// Returns how many refs are left, at the beginning and in order.
std::size_t pair_refs(const Topology& topology, std::span<PrimRef> refs);

/// The size of a part of a set.
struct PartSize {
    std::size_t refs = 0;
    std::size_t triangles = 0;
};

// Each function divides refs, which ascend by prim_id, in two, each ascending by prim_id, and
// returns the size of the first part. It writes that to out[0 ..), the second from as many refs on
// as the first has triangles: `out`, elsewhere, has room for a ref a triangle. It returns 0 and
// writes nothing where all centroids coincide. Which triangles go where depends on the set alone,
// neither on threads nor on the target: equal costs are decided by axis, then position; equal
// centroids by prim_id.

/// Bins over the bounds of the centroids (I. Wald. On fast construction of SAH-based bounding
/// volume hierarchies. 2007). Parallel for large sets.
PartSize split_binned(std::span<const PrimRef> refs, PrimRef* out,
                      const SimdTarget& target = best_simd_target());

/// Every position of every axis, for at most kFewRefs (Wald, Boulos, Shirley 2007, section 3).
inline constexpr std::size_t kFewRefs = 64;
PartSize split_few(std::span<const PrimRef> refs, PrimRef* out,
                   const SimdTarget& target = best_simd_target());

/// Halves by the order along the widest axis of the centroids: for sets that the others cannot
/// divide, and to bound the depth. Never 0 for two refs or more.
PartSize split_median(std::span<const PrimRef> refs, PrimRef* out,
                      const SimdTarget& target = best_simd_target());

// ---- Data that pass between the steps of a split

/// The cheapest place found so far. left_size counts triangles.
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
};

// Bins an axis for sets that are split in chunks, where bins take little of the time, and for
// others: more than 16 would make the build 7 % slower and the tree no better
// (lab/notes/build_and_refit.md).
inline constexpr std::size_t kManyBins = 32;
inline constexpr std::size_t kFewBins = 16;
using ManyBins = Bins<kManyBins>;
using FewBins = Bins<kFewBins>;

}  // namespace mray
