// Lets one text compile as C++ and as GLSL. Everything else in common/interop is written in the
// common subset: scalar types `float int uint bool`, vectors `vec3 vec4 uvec4`, free functions,
// plain structs, literals with suffixes.
//
//   SHARED        marks a function (inline in C++), SHARED_CONST a constant
//   PRECISE       marks every float local and result: no contraction, no reassociation
//   OUT(T)        an output parameter, INOUT(T) one that is also read
//   SHARED_BEGIN / SHARED_END   open and close namespace mray in C++
//
// Functions on Float, Uint, Bool and Float3 compile a third time: cpu/simd/lanes-inl.h includes
// their headers again with SHARED_LANES defined, for vectors with one ray or pixel in each lane.
// They have no branches; select(condition, a, b) takes the place of ?:, to_float(), to_uint() and
// broadcast() that of conversions, and && and || may evaluate both sides. What cannot be written so
// stands between #ifndef SHARED_LANES and #endif.
#ifndef COMMON_INTEROP_PLATFORM_H
#define COMMON_INTEROP_PLATFORM_H

#ifdef __cplusplus

#include <bit>
#include <cmath>
#include <cstdint>

#include <glm/ext/vector_uint3.hpp>
#include <glm/ext/vector_uint4.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#define SHARED inline
#define SHARED_CONST inline constexpr
#define PRECISE
#define OUT(T) T&
#define INOUT(T) T&
#define SHARED_BEGIN namespace mray {
#define SHARED_END }  // namespace mray

namespace mray {

using glm::uvec3;
using glm::uvec4;
using glm::vec3;
using glm::vec4;
using uint = std::uint32_t;

using Float = float;
using Uint = uint;
using Bool = bool;
using Float3 = vec3;

template <class T>
T select(bool condition, T a, T b) {
    return condition ? a : b;
}
inline float broadcast(float x) { return x; }
inline float to_float(uint x) { return static_cast<float>(x); }
inline uint to_uint(float x) { return static_cast<uint>(x); }
inline uint floatBitsToUint(float x) { return std::bit_cast<uint>(x); }
inline float uintBitsToFloat(uint x) { return std::bit_cast<float>(x); }
inline float abs(float x) { return std::fabs(x); }
}  // namespace mray

#else

#define SHARED
#define SHARED_CONST const
#define PRECISE precise
#define OUT(T) out T
#define INOUT(T) inout T
#define SHARED_BEGIN
#define SHARED_END

#define Float float
#define Uint uint
#define Bool bool
#define Float3 vec3
#define select(condition, a, b) ((condition) ? (a) : (b))
#define broadcast(x) (x)
#define to_float(x) float(x)
#define to_uint(x) uint(x)

#endif

SHARED_BEGIN

/// Minimum and maximum, where neither NaN nor the sign of a zero may decide anything. Not the
/// built-in ones: some devices take care of NaN in those, at three times the cost.
SHARED float lesser(float a, float b) { return a < b ? a : b; }
SHARED float greater(float a, float b) { return a > b ? a : b; }

SHARED_END

#endif  // COMMON_INTEROP_PLATFORM_H
