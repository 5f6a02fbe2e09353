// Splits that try every position of every axis, compiled once for each target.
#if defined(MORPHRAY_COMMON_BVH_BUILDER_SPLIT_POSITIONS_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef MORPHRAY_COMMON_BVH_BUILDER_SPLIT_POSITIONS_INL_H
#undef MORPHRAY_COMMON_BVH_BUILDER_SPLIT_POSITIONS_INL_H
#else
#define MORPHRAY_COMMON_BVH_BUILDER_SPLIT_POSITIONS_INL_H
#endif

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>

#include "common/bvh/builder/prim_ref-inl.h"
#include "common/bvh/builder/split.h"
#include "common/bvh/builder/split_cost-inl.h"

HWY_BEFORE_NAMESPACE();
namespace mray {
namespace HWY_NAMESPACE {
using namespace simd::HWY_NAMESPACE;

static_assert(kFewRefs % kMaxLanes == 0);

/// Writes to rank[i] how many of c[0 .. size) come before c[i], equal ones by their index. Both
/// arrays have room for a multiple of kLanes; c[size ..) is +infinity.
HWY_INLINE void rank_all(const float* c, std::size_t size, std::int32_t* rank) {
    for (std::size_t block = 0; block < size; block += kLanes) {
        const FloatVec own = load(c + block);
        const auto first = static_cast<std::int32_t>(block);
        const auto end = static_cast<std::int32_t>(std::min<std::size_t>(block + kLanes, size));
        const IntVec index = hn::Iota(kInts, first);
        IntVec sum = splat(0);
        for (std::size_t j = 0; j < block; ++j) sum = increment(sum, splat(c[j]) <= own);
        for (std::int32_t j = first; j < end; ++j) {
            const FloatVec other = splat(c[j]);
            sum = increment(sum, (other < own) | ((other == own) & float_mask(splat(j) < index)));
        }
        for (std::size_t j = block + kLanes; j < size; ++j) sum = increment(sum, splat(c[j]) < own);
        store(sum, rank + block);
    }
}

/// The indices of at most kFewRefs refs by centroid, then by index, along each axis.
struct AxisOrders {
    alignas(64) std::int32_t rank[3][kFewRefs];
    std::uint8_t index[kFewRefs][3];

    HWY_INLINE explicit AxisOrders(std::span<const PrimRef> refs) {
        const std::size_t size = refs.size();
        alignas(64) float centroids[3][kFewRefs];
        for (std::size_t i = 0; i < size; ++i) {
            for (int axis = 0; axis < 3; ++axis) centroids[axis][i] = refs[i].centroid2(axis);
        }
        for (int axis = 0; axis < 3; ++axis) {
            std::fill(centroids[axis] + size,
                      centroids[axis] + (size + kLanes - 1) / kLanes * kLanes,
                      std::numeric_limits<float>::infinity());
            rank_all(centroids[axis], size, rank[axis]);
            for (std::size_t i = 0; i < size; ++i)
                index[rank[axis][i]][axis] = static_cast<std::uint8_t>(i);
        }
    }
};

HWY_INLINE Int4 splat_count(std::size_t count) { return splat4(static_cast<std::int32_t>(count)); }

std::size_t split_few(std::span<const PrimRef> refs, PrimRef* out) {
    const std::size_t size = refs.size();
    const Box bounds = bound_centroids(refs);
    const AxisOrders orders(refs);
    Float4 right_cost[kFewRefs];
    AxisBoxes right;
    for (std::size_t i = size; --i > 0;) {
        for (int axis = 0; axis < 3; ++axis) right.extend(axis, refs[orders.index[i][axis]].planes);
        right_cost[i] = part_costs(right, splat_count(size - i));
    }
    alignas(16) const float lower[4] = {bounds.lower.x, bounds.lower.y, bounds.lower.z, 0};
    alignas(16) const float upper[4] = {bounds.upper.x, bounds.upper.y, bounds.upper.z, 0};
    const Mask4 centroids_differ = load4(lower) < load4(upper);
    AxisBoxes left;
    CheapestPlaces places;
    for (std::size_t i = 1; i < size; ++i) {
        for (int axis = 0; axis < 3; ++axis)
            left.extend(axis, refs[orders.index[i - 1][axis]].planes);
        places.consider(centroids_differ, part_costs(left, splat_count(i)) + right_cost[i], i,
                        splat_count(i));
    }
    const Split best = places.best();
    if (best.position == 0) return 0;
    const std::int32_t* rank = orders.rank[best.axis];
    const auto position = static_cast<std::int32_t>(best.position);
    partition_refs(refs, out, 0, best.position, [=](const PrimRef& ref) HWY_ATTR {
        return rank[&ref - refs.data()] < position;
    });
    return best.position;
}

/// Considers every position of refs in the order of an axis. right_cost: as many, written before it
/// is read.
void sweep_axis(std::span<const PrimRef> refs, int axis, float* right_cost, Split& best) {
    const auto cost = [](Float8 planes, std::size_t count) HWY_ATTR {
        alignas(16) float d[4];
        store(minus_extent(planes), d);
        return (d[0] * d[1] + d[1] * d[2] + d[2] * d[0]) *
               (static_cast<float>(static_cast<std::int32_t>(count)) + kPartCost);
    };
    Float8 planes = splat8(kEmptyPlane);
    for (std::size_t i = refs.size(); --i > 0;) {
        planes = min(planes, load8(refs[i].planes));
        right_cost[i] = cost(planes, refs.size() - i);
    }
    planes = splat8(kEmptyPlane);
    for (std::size_t i = 1; i < refs.size(); ++i) {
        planes = min(planes, load8(refs[i - 1].planes));
        best.consider({cost(planes, i) + right_cost[i], axis, i, i});
    }
}

}  // namespace HWY_NAMESPACE
}  // namespace mray
HWY_AFTER_NAMESPACE();

#endif  // per target
