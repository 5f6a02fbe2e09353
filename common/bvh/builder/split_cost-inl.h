// Loops over refs, costs of splits for three axes at once, partition; compiled for each target.
#include <bit>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>

#include "common/bvh/builder/split.h"
#include "common/simd/fixed_vectors-inl.h"

HWY_BEFORE_NAMESPACE();
namespace mray {
namespace HWY_NAMESPACE {
using namespace simd::HWY_NAMESPACE;

/// The first three lanes of each.
HWY_INLINE Box box_of(Float4 lower, Float4 upper) {
    alignas(16) float l[4];
    alignas(16) float u[4];
    store(lower, l);
    store(upper, u);
    return {{l[0], l[1], l[2]}, {u[0], u[1], u[2]}};
}

HWY_INLINE Float4 load_vertex(std::span<const vec3> positions, std::uint32_t vertex) {
    // Nothing may follow the last vertex in memory.
    if (vertex == positions.size() - 1) [[unlikely]] {
        const vec3 p = positions[vertex];
        alignas(16) const float lanes[4] = {p.x, p.y, p.z, 0};
        return load4(lanes);
    }
    return load4_unaligned(&positions[vertex].x);
}

inline void make_refs(const Topology& topology, std::span<const vec3> positions,
                      std::uint32_t first, std::span<PrimRef> refs) {
    for (std::size_t i = 0; i < refs.size(); ++i) {
        const auto prim_id = first + static_cast<std::uint32_t>(i);
        const uvec3 t = topology.triangles[prim_id];
        Float4 lower = splat4(kEmptyPlane);
        Float4 upper = splat4(-kEmptyPlane);
        for (const std::uint32_t vertex : {t.x, t.y, t.z}) {
            if (!is_finite_vertex(positions[vertex])) [[unlikely]]
                continue;
            const Float4 p = load_vertex(positions, vertex);
            lower = min(lower, p);
            upper = max(upper, p);
        }
        float* const planes = refs[i].planes;
        store(lower, planes);
        store(-upper, planes + 4);
        planes[3] = std::bit_cast<float>(PrimRef::kIdBits | prim_id);
        refs[i].set_area();
    }
}

inline Box union_of(std::span<const PrimRef> refs) {
    Float8 planes = splat8(kEmptyPlane);
    for (const PrimRef& ref : refs) planes = min(planes, load8(ref.planes));
    return box_of(low_half(planes), -high_half(planes));
}

inline Box bound_centroids(std::span<const PrimRef> refs) {
    // Two of each, so that neither waits for the other.
    Float4 lower[2] = {splat4(kEmptyPlane), splat4(kEmptyPlane)};
    Float4 upper[2] = {splat4(-kEmptyPlane), splat4(-kEmptyPlane)};
    const auto add = [&](std::size_t i) HWY_ATTR {
        const PrimRef& ref = refs[i];
        if (ref.empty()) return;
        const Float4 centroid2 = load4(ref.planes) - load4(ref.planes + 4);
        lower[i % 2] = min(lower[i % 2], centroid2);
        upper[i % 2] = max(upper[i % 2], centroid2);
    };
    for (std::size_t i = 0; i + 1 < refs.size(); i += 2) {
        add(i);
        add(i + 1);
    }
    if (refs.size() % 2 != 0) add(refs.size() - 1);
    return box_of(min(lower[0], lower[1]), max(upper[0], upper[1]));
}

/// A box for each axis, as in PrimRef.
struct AxisBoxes {
    Float8 planes[3] = {splat8(kEmptyPlane), splat8(kEmptyPlane), splat8(kEmptyPlane)};

    // Not implicit: that one would not be compiled for the target.
    HWY_INLINE AxisBoxes() {}

    HWY_INLINE void extend(const Bin& bin) {
        for (int axis = 0; axis < 3; ++axis)
            planes[axis] = min(planes[axis], load8(bin.planes[axis]));
    }
};

/// lower - upper in the first three lanes, or 0 for an empty box.
HWY_INLINE Float4 minus_extent(Float8 planes) {
    return min(low_half(planes) + high_half(planes), splat4(0.0f));
}

/// The cost of a part for each axis: half the area of its box, times its triangles and kPartCost.
HWY_INLINE Float4 part_costs(const AxisBoxes& boxes, Int4 count) {
    Float4 d[3];
    transpose3(minus_extent(boxes.planes[0]), minus_extent(boxes.planes[1]),
               minus_extent(boxes.planes[2]), d);
    const Float4 area = d[0] * d[1] + d[1] * d[2] + d[2] * d[0];
    return area * (to_float(count) + splat4(kPartCost));
}

/// The cheapest place so far on each axis, which is a lane: the first of several.
struct CheapestPlaces {
    Float4 cost = splat4(std::numeric_limits<float>::infinity());
    Int4 position = splat4(0);
    Int4 left_size = splat4(0);

    HWY_INLINE CheapestPlaces() {}

    HWY_INLINE void consider(Mask4 allowed, Float4 other_cost, std::size_t other_position,
                             Int4 other_left_size) {
        const Mask4 better = allowed & (other_cost < cost);
        cost = select(better, other_cost, cost);
        position = select(better, splat4(static_cast<std::int32_t>(other_position)), position);
        left_size = select(better, other_left_size, left_size);
    }
    HWY_INLINE Split best() const {
        alignas(16) float costs[4];
        alignas(16) std::int32_t positions[4];
        alignas(16) std::int32_t left_sizes[4];
        store(cost, costs);
        store(position, positions);
        store(left_size, left_sizes);
        Split split;
        for (int axis = 0; axis < 3; ++axis) {
            split.consider({costs[axis], axis, static_cast<std::uint32_t>(positions[axis]),
                            static_cast<std::uint32_t>(left_sizes[axis])});
        }
        return split;
    }
};

/// Writes refs to `out` from left_index on if `goes_left`, else from right_index on; returns the
/// index after the last left one. Without a branch, as one would be mispredicted half of the time,
/// and in whole registers: what is stored in halves and soon loaded as a whole waits.
template <class GoesLeft>
HWY_INLINE std::size_t partition_refs(std::span<const PrimRef> refs, PrimRef* out,
                                      std::size_t left_index, std::size_t right_index,
                                      GoesLeft goes_left) {
    for (const PrimRef& ref : refs) {
        const std::size_t is_left = goes_left(ref) ? 1 : 0;
        PrimRef& to = out[right_index ^ ((left_index ^ right_index) & -is_left)];
        store(load8(ref.planes), to.planes);
        left_index += is_left;
        right_index += 1 - is_left;
    }
    return left_index;
}

}  // namespace HWY_NAMESPACE
}  // namespace mray
HWY_AFTER_NAMESPACE();
