// A set of triangles as the builder sees it, and choosing where to divide it.
#pragma once

#include <bit>
#include <limits>

#include "common/base/watch.h"
#include "common/bvh/box.h"
#include "common/scene/mesh.h"
#include "common/simd/simd_target.h"

namespace mray {

/// The box and the id of a triangle (or of a part of a tree, see build_binary_tree), as eight
/// floats: lower x y z, id, -upper x y z, half the area. The union of two boxes is then one
/// minimum. The id is stored as the bits of a large float: denormal numbers and NaNs are slow. A
/// pair has the box of two triangles, prim_id() and the one after it.
struct alignas(32) PrimRef {
    float planes[8];

    static constexpr std::uint32_t kIdBits = 0x40000000;
    static constexpr std::uint32_t kPairBit = 0x20000000;

    PrimRef() = default;
    PrimRef(const Box& box, std::uint32_t prim_id)
        : planes{box.lower.x,  box.lower.y,  box.lower.z,  std::bit_cast<float>(kIdBits | prim_id),
                 -box.upper.x, -box.upper.y, -box.upper.z, 0} {
        set_area();
    }

    std::uint32_t prim_id() const { return id_bits() & (kPairBit - 1); }
    /// 1, or 2 for a pair.
    std::uint32_t triangle_count() const { return id_bits() & kPairBit ? 2 : 1; }
    /// Half the surface area of the box; 0 for an empty one.
    float area() const { return planes[7]; }
    Box box() const {
        return {{planes[0], planes[1], planes[2]}, {-planes[4], -planes[5], -planes[6]}};
    }
    /// Whether the box is Box(). Compares bits, in one instruction.
    bool empty() const {
        return std::bit_cast<std::uint32_t>(planes[0]) == std::bit_cast<std::uint32_t>(kEmptyPlane);
    }
    /// Twice the centroid of the box, rounded once; 0 for an empty one.
    float centroid2(int axis) const { return planes[axis] - planes[4 + axis]; }

    /// Computes the area from the planes of the box.
    void set_area() {
        const float x = -planes[4] - planes[0];
        const float y = -planes[5] - planes[1];
        const float z = -planes[6] - planes[2];
        planes[7] = empty() ? 0 : x * y + y * z + z * x;
    }
    /// Makes this a pair of the triangles `first` and first + 1, whose box it has already.
    void make_pair_of(std::uint32_t first) {
        planes[3] = std::bit_cast<float>(kIdBits | kPairBit | first);
    }

private:
    std::uint32_t id_bits() const { return std::bit_cast<std::uint32_t>(planes[3]); }
};

/// Sets the refs of the triangles first .. first + refs.size() - 1, whose boxes leave out vertices
/// that are not finite. positions has one entry for each vertex of the topology.
void make_refs(const Topology& topology, std::span<const vec3> positions, std::uint32_t first,
               std::span<PrimRef> refs, const SimdTarget& target = best_simd_target());

/// The union of the boxes of the refs; empty for none.
Box union_of(std::span<const PrimRef> refs, const SimdTarget& target = best_simd_target());

/// The size of the first part of a set, and the sum of the SAH costs of both parts, if known.
struct PartSize {
    std::size_t refs = 0;
    std::size_t triangles = 0;
    float cost = std::numeric_limits<float>::infinity();
};

// Each function divides refs, which ascend by prim_id, in two, each ascending by prim_id, and
// returns the size of the first part. It writes that to out[0 ..), the second from as many refs on
// as the first has triangles: `out`, elsewhere, has room for a ref a triangle. It returns 0 and
// writes nothing where all centroids coincide. The result depends on the set alone, neither on
// threads nor on the target: equal costs are decided by axis, then position; centroids by prim_id.

/// Bins over the bounds of the centroids (I. Wald. On fast construction of SAH-based bounding
/// volume hierarchies. 2007). For large sets a sample finds the place, and all threads divide.
PartSize split_binned(std::span<const PrimRef> refs, PrimRef* out,
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
// Bins an axis: more make the build 7 % slower, the tree no better (lab/notes/build_and_refit.md).
inline constexpr std::size_t kBins = 16;
// For sets of at most so many refs half as many bins do.
inline constexpr std::size_t kFewRefs = 32;

/// Maps twice a centroid to its bin along each axis: (centroid2 - lower) * scale, clamped to
/// [0, bins - 1] and rounded down. Lane 3 and axes along which no refs differ have scale 0.
struct Binning {
    Binning() = default;
    /// bounds: those of twice the centroids of a set of so many refs.
    Binning(const Box& bounds, std::size_t refs) : bins(refs <= kFewRefs ? kBins / 2 : kBins) {
        for (int axis = 0; axis < 3; ++axis) {
            lower[axis] = bounds.lower[axis];
            const float extent = bounds.upper[axis] - bounds.lower[axis];
            // A hair less than `bins`, so that the largest centroid falls into the last bin.
            if (extent > 0) scale[axis] = static_cast<float>(bins) * 0.9999f / extent;
        }
    }

    std::size_t bins = kBins;
    alignas(16) float lower[4] = {};
    alignas(16) float scale[4] = {};
};

/// The triangles in a bin of each axis. The size is a power of two, for a fast address.
struct alignas(32) Bin {
    /// The union of the boxes, as in PrimRef.
    float planes[3][8];
    /// Triangles for each axis; count[3] is 0.
    std::int32_t count[4];
};

// ---- Large triangles apart from small ones

/// Divides refs as split_binned does, but the larger boxes from the smaller ones, if that costs
/// less than `other`, a split of the same set; otherwise returns a size of 0. It helps where a few
/// boxes are large, as those of walls in a room. `triangles`: of the set. `largest`: an upper bound
/// of the areas of its boxes, lowered to the largest area where that is smaller.
PartSize split_by_area(std::span<const PrimRef> refs, PrimRef* out, std::size_t triangles,
                       const PartSize& other, float& largest);

/// The largest area of a box; 0 for no refs.
float largest_area(std::span<const PrimRef> refs);

// ---- Refs of two triangles each, such as halves of a quadrangle, which halve the work of splits

/// Makes pairs of neighbours that share one edge and whose common box is small. refs are triangles
/// with ascending ids without gaps. Returns how many refs are left, at the beginning and in order.
std::size_t pair_refs(const Topology& topology, std::span<PrimRef> refs);

/// Makes the refs of all triangles, the same for any number of threads, in one of two arrays with
/// room for a ref a triangle. Throws Error(kCancelled) soon after the watch asks for it.
std::span<PrimRef> make_paired_refs(const Topology& topology, std::span<const vec3> positions,
                                    PrimRef* first, PrimRef* second, const SimdTarget& target,
                                    const Watch& watch);

/// Makes single refs of refs[0 .. count), all of triangles, which have room for a ref a triangle.
void open_pairs(const Topology& topology, std::span<const vec3> positions, PrimRef* refs,
                std::size_t count, std::size_t triangles, const SimdTarget& target);

}  // namespace mray
