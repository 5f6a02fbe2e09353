// The arithmetic that every conformant device rounds alike: + - * on floats under round-to-nearest,
// comparisons, selects, integers and bit casts. No division, square root, fma or built-in dot.
// docs/design/arithmetic.md derives the bounds that are quoted here.
#ifndef COMMON_INTEROP_ARITHMETIC_H
#define COMMON_INTEROP_ARITHMETIC_H

#include "common/interop/constants.h"
#include "common/interop/platform.h"

SHARED_BEGIN

/// Sum in the fixed order (x + y) + z.
SHARED float dot3(vec3 a, vec3 b) {
    PRECISE float x = a.x * b.x;
    PRECISE float y = a.y * b.y;
    PRECISE float z = a.z * b.z;
    PRECISE float s = x + y;
    PRECISE float r = s + z;
    return r;
}

/// Exactly antisymmetric: cross3(a, b) == -cross3(b, a), bit for bit up to the sign of zeros.
SHARED vec3 cross3(vec3 a, vec3 b) {
    PRECISE float x0 = a.y * b.z;
    PRECISE float x1 = a.z * b.y;
    PRECISE float y0 = a.z * b.x;
    PRECISE float y1 = a.x * b.z;
    PRECISE float z0 = a.x * b.y;
    PRECISE float z1 = a.y * b.x;
    PRECISE vec3 r = vec3(x0 - x1, y0 - y1, z0 - z1);
    return r;
}

/// 1/x to 1.2 ulp for 2^-126 <= |x| <= 2^102: a linear guess on the bits, two Newton steps, and one
/// in residual form. Outside that range the result is unspecified but the same everywhere.
/// Checked: proofs/reciprocals.cpp.
SHARED float rcp(float x) {
    PRECISE float ax = abs(x);
    PRECISE float y = uintBitsToFloat(0x7EF311C7u - floatBitsToUint(ax));
    PRECISE float e0 = 2.0f - ax * y;
    y = y * e0;
    PRECISE float e1 = 2.0f - ax * y;
    y = y * e1;
    PRECISE float e2 = 1.0f - ax * y;
    y = y + y * e2;
    return x < 0.0f ? -y : y;
}

/// 1/sqrt(x) to 2 ulp for 2^-100 <= x <= 2^100: a guess on the bits and three Newton steps, the
/// last in residual form.
/// Checked: proofs/reciprocals.cpp.
SHARED float rsqrt(float x) {
    PRECISE float h = 0.5f * x;
    PRECISE float y = uintBitsToFloat(0x5F375A86u - (floatBitsToUint(x) >> 1u));
    PRECISE float e0 = 1.5f - (h * y) * y;
    y = y * e0;
    PRECISE float e1 = 1.5f - (h * y) * y;
    y = y * e1;
    PRECISE float e2 = 0.5f - (h * y) * y;
    y = y + y * e2;
    return y;
}

/// The same value on the coordinate grid: a multiple of 2^-40, and never -0. |x| >= 2^-17 is on it
/// already; what is smaller rounds to a multiple of 2^-39, the ulp of the constant that is added
/// and subtracted.
SHARED float snap_coordinate(float x) {
    PRECISE float s = x + kCoordinateSnap;
    PRECISE float r = s - kCoordinateSnap;
    return abs(x) >= kCoordinateOnGrid ? x : r;
}

SHARED vec3 snap_point(vec3 p) {
    return vec3(snap_coordinate(p.x), snap_coordinate(p.y), snap_coordinate(p.z));
}

/// Likewise for direction components: a multiple of 2^-46 (2^-45 below 2^-23), never -0.
SHARED float snap_direction_component(float x) {
    PRECISE float s = x + kDirectionSnap;
    PRECISE float r = s - kDirectionSnap;
    return abs(x) >= kDirectionOnGrid ? x : r;
}

/// 2^-k for 2^k <= x < 2^(k+1): the power of two that brings x into [1, 2). 2^-126 <= x < 2^127.
SHARED float scale_to_unit(float x) {
    return uintBitsToFloat(0x7F000000u - (floatBitsToUint(x) & 0x7F800000u));
}

/// 2^k for 2^k <= x < 2^(k+1): the inverse of scale_to_unit.
SHARED float power_of_two_below(float x) {
    return uintBitsToFloat(floatBitsToUint(x) & 0x7F800000u);
}

SHARED float largest_component(vec3 v) { return greater(greater(abs(v.x), abs(v.y)), abs(v.z)); }

/// A direction as rays carry it: scaled by a power of two to a largest component in [1, 2), on the
/// direction grid. Zero stays zero.
SHARED vec3 canonical_direction(vec3 d) {
    float largest = largest_component(d);
    PRECISE float s = largest > 0.0f ? scale_to_unit(largest) : 1.0f;
    PRECISE vec3 scaled = vec3(d.x * s, d.y * s, d.z * s);
    return vec3(snap_direction_component(scaled.x), snap_direction_component(scaled.y),
                snap_direction_component(scaled.z));
}

SHARED_END

#endif  // COMMON_INTEROP_ARITHMETIC_H
