// One ray against the 16 boxes of a node.
#if defined(MORPHRAY_CPU_WIDE_NODE_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef MORPHRAY_CPU_WIDE_NODE_INL_H
#undef MORPHRAY_CPU_WIDE_NODE_INL_H
#else
#define MORPHRAY_CPU_WIDE_NODE_INL_H
#endif

#include <cstddef>
#include <cstdint>

#include "cpu/ray_stream-inl.h"
#include "cpu/wide_vector-inl.h"

HWY_BEFORE_NAMESPACE();
namespace morphray::cpu {
namespace HWY_NAMESPACE {

/// Vector v of the planes at this many bytes into the node.
HWY_INLINE FloatVec load_planes(const Node& node, std::size_t offset, std::size_t v) {
    const std::byte* planes = reinterpret_cast<const std::byte*>(&node) + offset;
    return hn::LoadU(kFloats, reinterpret_cast<const float*>(planes) + v * kLanes);
}

/// The slots whose boxes the ray meets no later than t, as bits, and where it enters each box. The
/// operations are those of hits_box, in vectors: a bit is set if and only if hits_box is true and
/// its t_enter <= t, with the same t_enter (but for the sign of a zero).
HWY_INLINE std::uint32_t met_slots(const RayStream& stream, std::size_t ray, float t,
                                   const Node& node, FloatVec* HWY_RESTRICT t_enter) {
    std::uint32_t slots = 0;
    for (std::size_t v = 0; v < kVectors; ++v) {
        FloatVec enter[3];
        FloatVec leave[3];
        for (int axis = 0; axis < 3; ++axis) {
            const std::size_t near_offset = stream.near_offset[axis][ray];
            const FloatVec near = load_planes(node, near_offset, v);
            const FloatVec far = load_planes(node, near_offset ^ kPlaneBytes, v);
            const FloatVec rdir = broadcast(stream.rdir[axis][ray]);
            enter[axis] = hn::Mul(hn::Sub(near, broadcast(stream.near_org[axis][ray])), rdir);
            leave[axis] = hn::Mul(hn::Sub(far, broadcast(stream.far_org[axis][ray])), rdir);
        }
        t_enter[v] = hn::Max(hn::Max(enter[0], enter[1]), hn::Max(enter[2], hn::Zero(kFloats)));
        const FloatVec end = hn::Min(hn::Min(leave[0], leave[1]), hn::Min(leave[2], broadcast(t)));
        slots |= bits_of(hn::Le(t_enter[v], end)) << (v * kLanes);
    }
    return slots;
}

/// The slots that hold leaves, as bits; empty slots count as such.
HWY_INLINE std::uint32_t leaf_slots(const Node& node) {
    std::uint32_t slots = 0;
    for (std::size_t v = 0; v < kVectors; ++v) {
        const auto children = hn::BitCast(kInts, hn::LoadU(kUints, node.child + v * kLanes));
        const auto is_leaf = hn::Lt(children, hn::Zero(kInts));
        slots |= bits_of(hn::RebindMask(kFloats, is_leaf)) << (v * kLanes);
    }
    return slots;
}

}  // namespace HWY_NAMESPACE
}  // namespace morphray::cpu
HWY_AFTER_NAMESPACE();

#endif  // per target
