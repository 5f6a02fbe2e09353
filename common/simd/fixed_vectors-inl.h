// Vectors of four and of eight floats on every target, for data that come in fours: a point with
// its neighbour in memory, the lower or upper corner of a box, a number for each axis. A target
// whose vectors are shorter has vectors of the compiler. Compiled once for each target.
#if defined(MORPHRAY_COMMON_SIMD_FIXED_VECTORS_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef MORPHRAY_COMMON_SIMD_FIXED_VECTORS_INL_H
#undef MORPHRAY_COMMON_SIMD_FIXED_VECTORS_INL_H
#else
#define MORPHRAY_COMMON_SIMD_FIXED_VECTORS_INL_H
#endif

#include <bit>
#include <cstdint>
#include <cstring>

#include "common/simd/vectors-inl.h"

HWY_BEFORE_NAMESPACE();
namespace mray::simd {
namespace HWY_NAMESPACE {

#if HWY_TARGET == HWY_SCALAR

// The compiler's own vectors, which have operators.
using Float4 = float __attribute__((vector_size(16)));
using Int4 = std::int32_t __attribute__((vector_size(16)));
using Mask4 = Int4;

HWY_INLINE Float4 splat4(float x) { return Float4{x, x, x, x}; }
HWY_INLINE Int4 splat4(std::int32_t x) { return Int4{x, x, x, x}; }
HWY_INLINE Float4 load4(const float* from) { return Float4{from[0], from[1], from[2], from[3]}; }
HWY_INLINE Int4 load4(const std::int32_t* from) { return Int4{from[0], from[1], from[2], from[3]}; }
HWY_INLINE Float4 load4_unaligned(const float* from) { return load4(from); }
HWY_INLINE void store(Float4 v, float* to) { std::memcpy(to, &v, sizeof v); }
HWY_INLINE void store(Int4 v, std::int32_t* to) { std::memcpy(to, &v, sizeof v); }

HWY_INLINE Float4 min(Float4 a, Float4 b) { return a < b ? a : b; }
HWY_INLINE Float4 max(Float4 a, Float4 b) { return a > b ? a : b; }
HWY_INLINE Mask4 differ(Int4 a, Int4 b) { return a != b; }
template <class Vec>
HWY_INLINE Vec select(Mask4 m, Vec a, Vec b) {
    return m ? a : b;
}
HWY_INLINE Float4 to_float(Int4 v) { return __builtin_convertvector(v, Float4); }
template <int kShift>
HWY_INLINE Int4 floor_shifted(Float4 v) {
    return __builtin_convertvector(v, Int4) << kShift;
}
HWY_INLINE void transpose3(Float4 a, Float4 b, Float4 c, Float4 (&out)[3]) {
    for (int i = 0; i < 3; ++i) out[i] = Float4{a[i], b[i], c[i], 0};
}

#else

using Float4Tag = hn::CappedTag<float, 4>;
using Int4Tag = hn::RebindToSigned<Float4Tag>;
using Float4 = hn::Vec<Float4Tag>;
using Int4 = hn::Vec<Int4Tag>;
using Mask4 = hn::Mask<Float4Tag>;

inline constexpr Float4Tag kFloats4;
inline constexpr Int4Tag kInts4;

HWY_INLINE Float4 load4(const float* from) { return hn::Load(kFloats4, from); }
HWY_INLINE Int4 load4(const std::int32_t* from) { return hn::Load(kInts4, from); }
HWY_INLINE Float4 load4_unaligned(const float* from) { return hn::LoadU(kFloats4, from); }
HWY_INLINE Float4 splat4(float x) { return hn::Set(kFloats4, x); }
HWY_INLINE Int4 splat4(std::int32_t x) { return hn::Set(kInts4, x); }

#if HWY_MAX_BYTES > 16  // otherwise these are the functions of FloatVec
HWY_INLINE void store(Float4 v, float* to) { hn::Store(v, kFloats4, to); }
HWY_INLINE void store(Int4 v, std::int32_t* to) { hn::Store(v, kInts4, to); }
HWY_INLINE Float4 operator-(Float4 v) { return hn::Neg(v); }
HWY_INLINE Float4 min(Float4 a, Float4 b) { return hn::Min(a, b); }
HWY_INLINE Float4 max(Float4 a, Float4 b) { return hn::Max(a, b); }
HWY_INLINE Mask4 operator&(Mask4 a, Mask4 b) { return hn::And(a, b); }
HWY_INLINE Float4 select(Mask4 m, Float4 a, Float4 b) { return hn::IfThenElse(m, a, b); }
#endif
HWY_INLINE Int4 select(Mask4 m, Int4 a, Int4 b) {
    return hn::IfThenElse(hn::RebindMask(kInts4, m), a, b);
}
HWY_INLINE Mask4 differ(Int4 a, Int4 b) { return hn::RebindMask(kFloats4, a != b); }

HWY_INLINE Float4 to_float(Int4 v) { return hn::ConvertTo(kFloats4, v); }

/// v rounded down, times 2^kShift, for v in [0, 2^(23 - kShift)). The last bits of
/// floor(v) + 2^(23 - kShift) are the result. hn::ConvertTo takes three operations more, for values
/// that do not fit; only SSSE3 emulates hn::Floor by more than that.
template <int kShift>
HWY_INLINE Int4 floor_shifted(Float4 v) {
    if constexpr (HWY_TARGET == HWY_SSSE3) return hn::ShiftLeft<kShift>(hn::ConvertTo(kInts4, v));
    constexpr auto kBase = static_cast<float>(1 << (23 - kShift));
    return hn::BitCast(kInts4, hn::Floor(v) + splat4(kBase)) -
           splat4(std::bit_cast<std::int32_t>(kBase));
}

/// out[i] becomes lane i of a, b and c; its lane 3 is unspecified.
HWY_INLINE void transpose3(Float4 a, Float4 b, Float4 c, Float4 (&out)[3]) {
    const Float4 low = hn::InterleaveLower(kFloats4, a, b);
    const Float4 low_c = hn::InterleaveLower(kFloats4, c, c);
    out[0] = hn::ConcatLowerLower(kFloats4, low_c, low);
    out[1] = hn::ConcatUpperUpper(kFloats4, low_c, low);
    out[2] = hn::ConcatUpperLower(kFloats4, c, hn::InterleaveUpper(kFloats4, a, b));
}

#endif  // HWY_TARGET

// ---- Eight floats: one register where there are such, otherwise two of four

#if HWY_MAX_BYTES >= 32

using Float8Tag = hn::CappedTag<float, 8>;
using Float8 = hn::Vec<Float8Tag>;
inline constexpr Float8Tag kFloats8;

HWY_INLINE Float8 load8(const float* from) { return hn::Load(kFloats8, from); }
HWY_INLINE Float8 splat8(float x) { return hn::Set(kFloats8, x); }
HWY_INLINE Float4 low_half(Float8 v) { return hn::LowerHalf(v); }
HWY_INLINE Float4 high_half(Float8 v) { return hn::UpperHalf(kFloats4, v); }
#if HWY_MAX_BYTES > 32  // otherwise these are the functions of FloatVec
HWY_INLINE void store(Float8 v, float* to) { hn::Store(v, kFloats8, to); }
HWY_INLINE Float8 min(Float8 a, Float8 b) { return hn::Min(a, b); }
#endif

#else

struct Float8 {
    Float4 low;
    Float4 high;
};

HWY_INLINE Float8 load8(const float* from) { return {load4(from), load4(from + 4)}; }
HWY_INLINE Float8 splat8(float x) { return {splat4(x), splat4(x)}; }
HWY_INLINE Float4 low_half(Float8 v) { return v.low; }
HWY_INLINE Float4 high_half(Float8 v) { return v.high; }
HWY_INLINE void store(Float8 v, float* to) {
    store(v.low, to);
    store(v.high, to + 4);
}
HWY_INLINE Float8 min(Float8 a, Float8 b) { return {min(a.low, b.low), min(a.high, b.high)}; }

#endif

}  // namespace HWY_NAMESPACE
}  // namespace mray::simd
HWY_AFTER_NAMESPACE();

#endif  // per target
