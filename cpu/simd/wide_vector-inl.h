// Vectors of floats and unsigned integers, of at most 16 lanes: a node's 16 boxes or a leaf's 16
// triangles are kVectors of them.
#if defined(MORPHRAY_CPU_SIMD_WIDE_VECTOR_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef MORPHRAY_CPU_SIMD_WIDE_VECTOR_INL_H
#undef MORPHRAY_CPU_SIMD_WIDE_VECTOR_INL_H
#else
#define MORPHRAY_CPU_SIMD_WIDE_VECTOR_INL_H
#endif

#include <hwy/highway.h>

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <type_traits>

#include "common/interop/bvh_layout.h"

HWY_BEFORE_NAMESPACE();
namespace morphray::cpu {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using FloatTag = hn::CappedTag<float, kWidth>;
using UintTag = hn::RebindToUnsigned<FloatTag>;
using IntTag = hn::RebindToSigned<FloatTag>;
using ByteTag = hn::Repartition<std::uint8_t, FloatTag>;
using FloatVec = hn::Vec<FloatTag>;
using UintVec = hn::Vec<UintTag>;
using FloatMask = hn::Mask<FloatTag>;
using UintMask = hn::Mask<UintTag>;

inline constexpr FloatTag kFloats;
inline constexpr UintTag kUints;
inline constexpr IntTag kInts;
inline constexpr ByteTag kBytes;
inline constexpr std::size_t kLanes = hn::MaxLanes(FloatTag());
inline constexpr std::size_t kVectors = kWidth / kLanes;
inline constexpr std::uint32_t kLaneBits = (1u << kLanes) - 1;

HWY_INLINE FloatVec broadcast(float x) { return hn::Set(kFloats, x); }
HWY_INLINE FloatVec max3(FloatVec a, FloatVec b, FloatVec c) { return hn::Max(a, hn::Max(b, c)); }
HWY_INLINE FloatVec min3(FloatVec a, FloatVec b, FloatVec c) { return hn::Min(a, hn::Min(b, c)); }
HWY_INLINE FloatVec sum3(FloatVec a, FloatVec b, FloatVec c) { return hn::Add(hn::Add(a, b), c); }

/// a * b - c * d, rounded after each operation.
HWY_INLINE FloatVec difference(FloatVec a, FloatVec b, FloatVec c, FloatVec d) {
    return hn::Sub(hn::Mul(a, b), hn::Mul(c, d));
}

/// Lane i as bit i.
HWY_INLINE std::uint32_t bits_of(FloatMask mask) {
    // No more bytes than the mask has: a wider read would wait for the narrow write.
    using Bits = std::conditional_t<(kLanes > 8), std::uint16_t, std::uint8_t>;
    std::uint8_t bytes[sizeof(Bits)];
    hn::StoreMaskBits(kFloats, mask, bytes);
    Bits bits;
    std::memcpy(&bits, bytes, sizeof bits);
    return bits;
}

}  // namespace HWY_NAMESPACE
}  // namespace morphray::cpu
HWY_AFTER_NAMESPACE();

#endif  // per target
