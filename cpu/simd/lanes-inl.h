// The shared text of common/interop on vectors, in namespace `lanes`: each lane has its own ray,
// triangle or pixel, and gets the bits of the same function in namespace mray.
#if defined(MORPHRAY_CPU_SIMD_LANES_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef MORPHRAY_CPU_SIMD_LANES_INL_H
#undef MORPHRAY_CPU_SIMD_LANES_INL_H
#else
#define MORPHRAY_CPU_SIMD_LANES_INL_H
#endif

#include <cstdint>

#include "common/interop/camera.h"
#include "common/interop/closest_rule.h"
#include "common/interop/hit_rule.h"
#include "common/interop/pairs.h"
#include "common/interop/shading.h"
#include "common/interop/surface.h"
#include "common/interop/tie_break_rule.h"
#include "common/interop/winding_rule.h"
#include "common/simd/vectors-inl.h"

HWY_BEFORE_NAMESPACE();
namespace mray::cpu::HWY_NAMESPACE {
using namespace simd::HWY_NAMESPACE;

namespace lanes {

using Float = FloatVec;
using Uint = UintVec;
using Bool = Mask;

struct Float3 {
    Float x, y, z;

    Float3() = default;
    HWY_INLINE Float3(Float x_, Float y_, Float z_) : x(x_), y(y_), z(z_) {}
    HWY_INLINE explicit Float3(const Float v[3]) : x(v[0]), y(v[1]), z(v[2]) {}
    HWY_INLINE explicit Float3(vec3 v) : x(splat(v.x)), y(splat(v.y)), z(splat(v.z)) {}

    // Friends, so that they hide no operators of Float.
    friend HWY_INLINE Float3 operator-(Float3 v) { return {-v.x, -v.y, -v.z}; }
    friend HWY_INLINE Float3 operator+(Float3 a, Float3 b) {
        return {a.x + b.x, a.y + b.y, a.z + b.z};
    }
    friend HWY_INLINE Float3 operator-(Float3 a, Float3 b) {
        return {a.x - b.x, a.y - b.y, a.z - b.z};
    }
    friend HWY_INLINE Float3 select(Bool m, Float3 a, Float3 b) {
        return {select(m, a.x, b.x), select(m, a.y, b.y), select(m, a.z, b.z)};
    }
    friend HWY_INLINE Float3 select(UintMask m, Float3 a, Float3 b) {
        return select(float_mask(m), a, b);
    }
};

/// Stores x, y and z in three arrays, from this place on.
template <class Arrays>
HWY_INLINE void store3(const Float3& v, Arrays&& to, std::size_t at) {
    store(v.x, &to[0][at]);
    store(v.y, &to[1][at]);
    store(v.z, &to[2][at]);
}

HWY_INLINE Bool operator&&(Bool a, Bool b) { return a & b; }
HWY_INLINE Bool operator&&(Bool a, UintMask b) { return a & float_mask(b); }
HWY_INLINE Bool operator||(Bool a, Bool b) { return a | b; }
HWY_INLINE Bool operator||(Bool a, UintMask b) { return a | float_mask(b); }
using simd::HWY_NAMESPACE::select;
HWY_INLINE Uint select(Bool m, std::uint32_t a, Uint b) {
    return select(uint_mask(m), splat(a), b);
}
HWY_INLINE Uint select(Bool m, std::uint32_t a, std::uint32_t b) { return select(m, a, splat(b)); }
HWY_INLINE Float select(UintMask m, Float a, Float b) { return select(float_mask(m), a, b); }

HWY_INLINE Float lesser(Float a, Float b) { return min(a, b); }
HWY_INLINE Float lesser(Float a, float b) { return min(a, splat(b)); }
HWY_INLINE Float greater(Float a, Float b) { return max(a, b); }
HWY_INLINE Float greater(Float a, float b) { return max(a, splat(b)); }

HWY_INLINE Uint floatBitsToUint(Float x) { return as_uint(x); }
HWY_INLINE Float uintBitsToFloat(Uint x) { return as_float(x); }
HWY_INLINE Float broadcast(float x) { return splat(x); }
/// Numbers below 2^31.
HWY_INLINE Float to_float(Uint x) { return hn::ConvertTo(kFloats, as_int(x)); }
HWY_INLINE Uint to_uint(Float x) { return as_uint(hn::ConvertTo(kInts, x)); }

#if HWY_NATIVE_FMA
#define SHARED_FUSED_PRODUCT_ERROR
HWY_INLINE Float product_error(Float a, Float b, Float p) { return mul_sub(a, b, p); }
#endif

#define SHARED_LANES
#pragma push_macro("SHARED")
#pragma push_macro("SHARED_BEGIN")
#pragma push_macro("SHARED_END")
#undef SHARED
#undef SHARED_BEGIN
#undef SHARED_END
#define SHARED HWY_INLINE
#define SHARED_BEGIN
#define SHARED_END
// Each once more, after what it uses.
// clang-format off
#include "common/interop/arithmetic.h"
#include "common/interop/pairs.h"
#include "common/interop/slab.h"
#include "common/interop/hit_rule.h"
#include "common/interop/tie_break_rule.h"
#include "common/interop/camera.h"
#include "common/interop/surface.h"
#include "common/interop/shading.h"
#include "common/interop/closest_rule.h"
#include "common/interop/winding_rule.h"
// clang-format on
#pragma pop_macro("SHARED")
#pragma pop_macro("SHARED_BEGIN")
#pragma pop_macro("SHARED_END")
#undef SHARED_LANES
#undef SHARED_FUSED_PRODUCT_ERROR

}  // namespace lanes

}  // namespace mray::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per target
