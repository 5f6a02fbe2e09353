// The cost of a split for the three axes at once, and the partition, compiled once for each target.
#if defined(MORPHRAY_COMMON_BVH_BUILDER_SPLIT_COST_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef MORPHRAY_COMMON_BVH_BUILDER_SPLIT_COST_INL_H
#undef MORPHRAY_COMMON_BVH_BUILDER_SPLIT_COST_INL_H
#else
#define MORPHRAY_COMMON_BVH_BUILDER_SPLIT_COST_INL_H
#endif

#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>

#include "common/bvh/builder/split_parts.h"
#include "common/simd/fixed_vectors-inl.h"

HWY_BEFORE_NAMESPACE();
namespace mray {
namespace HWY_NAMESPACE {
using namespace simd::HWY_NAMESPACE;

/// A box for each axis, as in PrimRef.
struct AxisBoxes {
    Float8 planes[3] = {splat8(kEmptyPlane), splat8(kEmptyPlane), splat8(kEmptyPlane)};

    // Not implicit: that one would not be compiled for the target.
    HWY_INLINE AxisBoxes() {}

    HWY_INLINE void extend(int axis, const float* other) {
        planes[axis] = min(planes[axis], load8(other));
    }
    HWY_INLINE void extend(const Bin& bin) {
        for (int axis = 0; axis < 3; ++axis) extend(axis, bin.planes[axis]);
    }
};

/// lower - upper in the first three lanes, or 0 for an empty box.
HWY_INLINE Float4 minus_extent(Float8 planes) {
    return min(low_half(planes) + high_half(planes), splat4(0.0f));
}

/// The cost of a part for each axis: half the area of its box (0 if it is empty), times the number
/// of its triangles and kPartCost more.
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
    /// The first axis of several as cheap.
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

/// Writes refs to `out` from left_index on if `goes_left`, else from right_index on. Without a
/// branch, as one would be mispredicted half of the time, and in whole registers: what is stored in
/// halves and soon loaded as a whole waits.
template <class GoesLeft>
HWY_INLINE void partition_refs(std::span<const PrimRef> refs, PrimRef* out, std::size_t left_index,
                               std::size_t right_index, GoesLeft goes_left) {
    for (const PrimRef& ref : refs) {
        const std::size_t is_left = goes_left(ref) ? 1 : 0;
        PrimRef& to = out[right_index ^ ((left_index ^ right_index) & -is_left)];
        store(load8(ref.planes), to.planes);
        left_index += is_left;
        right_index += 1 - is_left;
    }
}

}  // namespace HWY_NAMESPACE
}  // namespace mray
HWY_AFTER_NAMESPACE();

#endif  // per target
