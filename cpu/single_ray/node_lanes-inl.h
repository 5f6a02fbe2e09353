// A ray against the 16 boxes of a node.
//
// As with hits_box, every box that holds a triangle which the ray hits is met, and is entered no
// later than last_entry of that hit; which other boxes are met and the last bits of t_enter may
// differ:
// 1. A plane is met at fl(plane * rdir - k) with k = fl(fl(org +- D) * rdir), fused or not.
// 2. In units of 2^-24 E (docs/design/arithmetic.md, "Boxes") and as a distance, which is divided
//    by rdir, that is off by at most
//        1    the rounding of org +- D
//        4.7  the reciprocal, 2.31 * 2^-24 of |plane - org| < 2.01 E
//        1    the product k
//        1    the product with the plane, unless it is fused
//        2.1  the difference
//    in all 9.8 < 19, the 3/5 D that are allowed for there.
// 3. k is a constant of the ray and rounding is monotone, so a box within a box is still met within
//    the interval of the other, bit for bit.
#if defined(MORPHRAY_CPU_SINGLE_RAY_NODE_LANES_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef MORPHRAY_CPU_SINGLE_RAY_NODE_LANES_INL_H
#undef MORPHRAY_CPU_SINGLE_RAY_NODE_LANES_INL_H
#else
#define MORPHRAY_CPU_SINGLE_RAY_NODE_LANES_INL_H
#endif

#include <cstddef>
#include <cstdint>

#include "common/simd/vectors-inl.h"
#include "cpu/single_ray/ray_stream-inl.h"

HWY_BEFORE_NAMESPACE();
namespace mray::cpu {
namespace HWY_NAMESPACE {
using namespace simd::HWY_NAMESPACE;

/// Vector v of the planes at this many bytes into the node.
HWY_INLINE FloatVec load_planes(const Node& node, std::size_t offset, std::size_t v) {
    const std::byte* planes = reinterpret_cast<const std::byte*>(&node) + offset;
    return load_unaligned(reinterpret_cast<const float*>(planes) + v * kLanes);
}

/// The slots whose boxes the ray enters no later than at `last`, as bits, and where it enters each
/// box.
HWY_INLINE std::uint32_t met_slots(const RayStream& stream, std::size_t ray, float last,
                                   const Node& node, FloatVec* HWY_RESTRICT t_enter) {
    std::uint32_t slots = 0;
    for (std::size_t v = 0; v < kVectors; ++v) {
        FloatVec enter[3];
        FloatVec leave[3];
        for (int axis = 0; axis < 3; ++axis) {
            const std::size_t near_offset = stream.near_offset[axis][ray];
            const FloatVec near = load_planes(node, near_offset, v);
            const FloatVec far = load_planes(node, near_offset ^ kPlaneBytes, v);
            const FloatVec rdir = splat(stream.rdir[axis][ray]);
            enter[axis] = mul_sub(near, rdir, splat(stream.k_near[axis][ray]));
            leave[axis] = mul_sub(far, rdir, splat(stream.k_far[axis][ray]));
        }
        t_enter[v] = max(max(enter[0], enter[1]), max(enter[2], zero()));
        const FloatVec end = min(min(leave[0], leave[1]), min(leave[2], splat(last)));
        slots |= bits_of(t_enter[v] <= end) << (v * kLanes);
    }
    return slots;
}

/// The slots that hold leaves, as bits; empty slots count as such.
HWY_INLINE std::uint32_t leaf_slots(const Node& node) {
    std::uint32_t slots = 0;
    for (std::size_t v = 0; v < kVectors; ++v) {
        const auto children = as_int(load_unaligned(node.child + v * kLanes));
        const auto is_leaf = children < hn::Zero(kInts);
        slots |= bits_of(float_mask(is_leaf)) << (v * kLanes);
    }
    return slots;
}

}  // namespace HWY_NAMESPACE
}  // namespace mray::cpu
HWY_AFTER_NAMESPACE();

#endif  // per target
