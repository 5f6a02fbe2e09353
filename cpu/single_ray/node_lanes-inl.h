// A ray against the 16 boxes of a node.
//
// As with hits_box, every box that holds a triangle which the ray hits is met, with a least depth
// that is not beyond last_depth of that hit; which other boxes are met and the last bits may
// differ:
//
// 1. A plane p is met at fl(p * r - k), where r = 1/d, times kStreamRounding at its far side,
//    and k = fl(org * r +- dilation * |r|).
// 2. In units of u = 2^-24, with r taken for exact, that is off by at most
//        1 |org r|    k
//        2 |org r|    both products, unless they are fused; of p r, the part with |org r|
//        1 t          the other part: |p - org| |r|
//        1 t          the difference
//    and r is off by 1 t, or 2 t at the far side. Products are fused where a target has
//    instructions for that (HWY_NATIVE_FMA).
// 3. kStreamDilation covers the parts with org, and least_dilation the 2^-42 E by which the ray
//    passes the padded box (docs/design/arithmetic.md, "Boxes") with all terms of second order.
// 4. kStreamRounding covers the parts with t (lab/proofs/near.g). So an entry is no later than
//    (1 + 2 u) t or (1 + 3 u) t of a hit, and the exit no earlier than that.
// 5. k and r are constants of the ray and rounding is monotone, so a box within a box is still met
//    within the interval of the other, bit for bit. Constants by target are in
//    cpu/simd/rounding_bounds.h.
#if defined(MORPHRAY_CPU_SINGLE_RAY_NODE_LANES_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef MORPHRAY_CPU_SINGLE_RAY_NODE_LANES_INL_H
#undef MORPHRAY_CPU_SINGLE_RAY_NODE_LANES_INL_H
#else
#define MORPHRAY_CPU_SINGLE_RAY_NODE_LANES_INL_H
#endif

#include <bit>
#include <cstddef>
#include <cstdint>

#include "common/bvh/bvh.h"
#include "common/simd/vectors-inl.h"
#include "cpu/simd/lanes-inl.h"
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

/// Where a ray enters a vector of boxes on each axis, and where it enters and leaves them; it meets
/// a box if enter <= leave.
struct BoxTimes {
    FloatVec enter_axis[3];
    FloatVec enter;
    FloatVec leave;
};

/// The times for vector v of a node's boxes, up to last_entry() of `last`.
HWY_INLINE BoxTimes box_times(const RayStream& stream, std::size_t ray, float last,
                              const Node& node, std::size_t v) {
    const FloatVec end = splat(last_entry(stream.depth_margin[ray], last));
    FloatVec enter[3];
    FloatVec leave[3];
    for (int axis = 0; axis < 3; ++axis) {
        const std::size_t near_offset = stream.near_offset[axis][ray];
        const FloatVec near = load_planes(node, near_offset, v);
        const FloatVec far = load_planes(node, near_offset ^ kPlaneBytes, v);
        enter[axis] = mul_sub(near, splat(stream.rdir[axis][ray]), splat(stream.k_near[axis][ray]));
        leave[axis] =
            mul_sub(far, splat(stream.rdir_far[axis][ray]), splat(stream.k_far[axis][ray]));
    }
    return {{enter[0], enter[1], enter[2]},
            max(max(enter[0], enter[1]), max(enter[2], zero())),
            min(min(leave[0], leave[1]), min(leave[2], end))};
}

/// The slots whose boxes the ray meets up to tfar, as bits.
HWY_INLINE std::uint32_t met_slots(const RayStream& stream, std::size_t ray, const Node& node) {
    std::uint32_t slots = 0;
    for (std::size_t v = 0; v < kVectors; ++v) {
        const BoxTimes times = box_times(stream, ray, stream.last_depth[ray], node, v);
        slots |= bits_of(times.enter <= times.leave) << (v * kLanes);
    }
    return slots;
}

/// Where the ray enters the boxes on its main axis, which is kAxis unless that is kAnyAxis.
template <int kAxis>
HWY_INLINE FloatVec enter_main_axis(const RayStream& stream, std::size_t ray, const Node& node,
                                    std::size_t v, const BoxTimes& times) {
    if constexpr (kAxis == kAnyAxis) {
        const std::uint32_t axis = stream.axis[ray];
        return mul_sub(load_planes(node, stream.near_offset[axis][ray], v),
                       splat(stream.rdir[axis][ray]), splat(stream.k_near[axis][ray]));
    } else {
        return times.enter_axis[kAxis];
    }
}

/// The slots whose boxes the ray meets with a least depth of `last` or less, as bits, and the least
/// depths of all boxes. kAxis is the ray's main axis, or kAnyAxis.
template <int kAxis = kAnyAxis>
HWY_INLINE std::uint32_t near_slots(const RayStream& stream, std::size_t ray, float last,
                                    const Node& node, FloatVec* HWY_RESTRICT t_least) {
    const FloatVec margin = splat(stream.depth_margin[ray]);
    std::uint32_t slots = 0;
    for (std::size_t v = 0; v < kVectors; ++v) {
        const BoxTimes times = box_times(stream, ray, last, node, v);
        const FloatVec along = enter_main_axis<kAxis>(stream, ray, node, v, times);
        const Mask met = (times.enter <= times.leave) & (along <= splat(last));
        t_least[v] = lanes::least_depth(times.enter, along, margin);
        slots |= bits_of(met) << (v * kLanes);
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
