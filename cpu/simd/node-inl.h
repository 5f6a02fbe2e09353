// The planes and the children of a node as vectors of slots. For scalars see common/bvh/node.h.
#if defined(MORPHRAY_CPU_SIMD_NODE_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef MORPHRAY_CPU_SIMD_NODE_INL_H
#undef MORPHRAY_CPU_SIMD_NODE_INL_H
#else
#define MORPHRAY_CPU_SIMD_NODE_INL_H
#endif

#include <bit>

#include "common/bvh/node.h"
#include "common/simd/fixed_vectors-inl.h"

HWY_BEFORE_NAMESPACE();
namespace mray::cpu::HWY_NAMESPACE {
using namespace simd::HWY_NAMESPACE;

// `slot` is the first slot of a vector.

/// The lower (side 0) or upper planes (side 1) of an axis.
HWY_INLINE FloatVec planes_of(const Node& node, std::uint32_t axis, std::uint32_t side,
                              std::size_t slot) {
    return load_unaligned(node.planes + plane_at(2 * axis + side, 0) + slot);
}

inline constexpr std::uint32_t kQuarters = kWidth / 4;

/// The planes of the four slots from 4 * quarter on.
HWY_INLINE Float4 four_planes(const Node& node, std::uint32_t axis, std::uint32_t side,
                              std::uint32_t quarter) {
    return load4(node.planes + plane_place(axis, side, 4 * quarter));
}

HWY_INLINE UintVec children_of(const Node& node, std::size_t slot) {
    return load_unaligned(node.child + slot);
}

/// The slots of leaves and the empty ones, as bits.
HWY_INLINE std::uint32_t leaf_slots(const Node& node) {
    return bits_of_sixteen([&](std::size_t slot) HWY_ATTR {
        return float_mask(as_int(children_of(node, slot)) < hn::Zero(kInts));
    });
}

// ---- Planes that a ray chooses, by the bytes from a node's start to them

// The two sides of an axis are this far apart by an exclusive or.
inline constexpr std::uint32_t kPlaneBytes = kPlaneStride * sizeof(float);
static_assert(std::has_single_bit(kPlaneBytes));

HWY_INLINE std::uint32_t plane_offset(std::uint32_t axis, std::uint32_t side) {
    return plane_at(2 * axis + side, 0) * static_cast<std::uint32_t>(sizeof(float));
}

HWY_INLINE std::uint32_t other_side(std::uint32_t offset) { return offset ^ kPlaneBytes; }

/// The planes at an offset, by slot.
HWY_INLINE const float* planes_at(const Node& node, std::uint32_t offset) {
    return reinterpret_cast<const float*>(reinterpret_cast<const std::byte*>(&node) + offset);
}

HWY_INLINE FloatVec planes_of(const Node& node, std::uint32_t offset, std::size_t slot) {
    return load_unaligned(planes_at(node, offset) + slot);
}

}  // namespace mray::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per target
