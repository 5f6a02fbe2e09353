// The arithmetic that every conformant device rounds in the same way: + - * on floats under
// round-to-nearest, comparisons, selects, integers and bit casts; no division, square root, fma or
// built-in dot. docs/design/arithmetic.md derives the bounds that are quoted here.
#if !defined(COMMON_INTEROP_ARITHMETIC_H) || defined(SHARED_LANES)
#ifndef COMMON_INTEROP_ARITHMETIC_H
#define COMMON_INTEROP_ARITHMETIC_H

#include "common/interop/constants.h"
#include "common/interop/platform.h"

#endif

SHARED_BEGIN

SHARED Float3 lesser3(Float3 a, Float3 b) {
    return Float3(lesser(a.x, b.x), lesser(a.y, b.y), lesser(a.z, b.z));
}

SHARED Float3 greater3(Float3 a, Float3 b) {
    return Float3(greater(a.x, b.x), greater(a.y, b.y), greater(a.z, b.z));
}

/// Sum in the fixed order (x + y) + z.
SHARED Float dot3(Float3 a, Float3 b) {
    PRECISE Float x = a.x * b.x;
    PRECISE Float y = a.y * b.y;
    PRECISE Float z = a.z * b.z;
    PRECISE Float s = x + y;
    PRECISE Float r = s + z;
    return r;
}

/// Exactly antisymmetric: cross3(a, b) == -cross3(b, a), bit for bit up to the sign of zeros.
SHARED Float3 cross3(Float3 a, Float3 b) {
    PRECISE Float x0 = a.y * b.z;
    PRECISE Float x1 = a.z * b.y;
    PRECISE Float y0 = a.z * b.x;
    PRECISE Float y1 = a.x * b.z;
    PRECISE Float z0 = a.x * b.y;
    PRECISE Float z1 = a.y * b.x;
    PRECISE Float3 r = Float3(x0 - x1, y0 - y1, z0 - z1);
    return r;
}

/// 1/x to 1.2 ulp for 2^-126 <= x <= 2^102: a linear guess on the bits, two Newton steps, and one
/// in residual form. Outside that range the result is unspecified but the same everywhere. Checked:
/// lab/proofs/reciprocals.cpp.
SHARED Float rcp_of_positive(Float x) {
    PRECISE Float y = uintBitsToFloat(0x7EF311C7u - floatBitsToUint(x));
    PRECISE Float e0 = 2.0f - x * y;
    y = y * e0;
    PRECISE Float e1 = 2.0f - x * y;
    y = y * e1;
    PRECISE Float e2 = 1.0f - x * y;
    y = y + y * e2;
    return y;
}

/// rcp_of_positive() for both signs.
SHARED Float rcp(Float x) {
    Float y = rcp_of_positive(abs(x));
    return select(x < 0.0f, -y, y);
}

/// The rounding error of the product p = a * b, exact (T. J. Dekker. A floating-point technique for
/// extending the available precision. 1971; with Veltkamp's splitting into 12 + 12 bits).
/// Exact: lab/proofs/small_floats.cpp.
///
/// A fused multiply-subtract a * b - p, where there is one, has the same bits, because the exact
/// error is a float (docs/design/arithmetic.md, "No denormals"). Where it is 0, both are +0: the
/// splitting begins with hh - p, and the sum of a +0 and a zero, or of x and -x, is +0.
#ifndef SHARED_FUSED_PRODUCT_ERROR
SHARED Float product_error(Float a, Float b, Float p) {
    PRECISE Float ca = 4097.0f * a;
    PRECISE Float cb = 4097.0f * b;
    PRECISE Float ta = ca - a;
    PRECISE Float tb = cb - b;
    PRECISE Float ah = ca - ta;
    PRECISE Float bh = cb - tb;
    PRECISE Float al = a - ah;
    PRECISE Float bl = b - bh;
    PRECISE Float hh = ah * bh;
    PRECISE Float hl = ah * bl;
    PRECISE Float lh = al * bh;
    PRECISE Float ll = al * bl;
    PRECISE Float e0 = hh - p;
    PRECISE Float e1 = e0 + hl;
    PRECISE Float e2 = e1 + lh;
    PRECISE Float e3 = e2 + ll;
    return e3;
}
#endif

/// The rounding error of the difference d = a - b, exact (D. E. Knuth. TAOCP 2, 4.2.2, theorem B).
/// Exact: lab/proofs/small_floats.cpp.
SHARED Float difference_error(Float a, Float b, Float d) {
    PRECISE Float bv = a - d;
    PRECISE Float av = d + bv;
    PRECISE Float be = bv - b;
    PRECISE Float ae = a - av;
    PRECISE Float e = ae + be;
    return e;
}

/// x on the grid 2^-63, so that products of two such values are no denormals: |x| >= 2^-40 is on it
/// already, smaller values round through the ulp of the constant.
SHARED Float snap_projected(Float x) {
    PRECISE Float s = x + kProjectedSnap;
    PRECISE Float r = s - kProjectedSnap;
    return select(abs(x) >= kProjectedOnGrid, x, r);
}

/// 1/sqrt(x) to 2 ulp for 2^-100 <= x <= 2^100: a guess on the bits and three Newton steps, the
/// last in residual form. Checked: lab/proofs/reciprocals.cpp.
SHARED Float rsqrt(Float x) {
    PRECISE Float h = 0.5f * x;
    PRECISE Float y = uintBitsToFloat(0x5F375A86u - (floatBitsToUint(x) >> 1u));
    PRECISE Float e0 = 1.5f - (h * y) * y;
    y = y * e0;
    PRECISE Float e1 = 1.5f - (h * y) * y;
    y = y * e1;
    PRECISE Float e2 = 0.5f - (h * y) * y;
    y = y + y * e2;
    return y;
}

/// x on the coordinate grid: a multiple of 2^-40, and never -0. |x| >= 2^-17 is on it
/// already; the rest rounds to a multiple of 2^-39, the ulp of the constant that is added.
SHARED Float snap_coordinate(Float x) {
    PRECISE Float s = x + kCoordinateSnap;
    PRECISE Float r = s - kCoordinateSnap;
    return select(abs(x) >= kCoordinateOnGrid, x, r);
}

#ifdef SHARED_LANES
/// Whether no component of a lane is less than `least`: most vectors have none that a grid changes.
SHARED bool all_beyond(Float3 v, float least) {
    return HWY_LIKELY(all(min3(abs(v.x), abs(v.y), abs(v.z)) >= splat(least)));
}
#endif

SHARED Float3 snap_point(Float3 p) {
#ifdef SHARED_LANES
    if (all_beyond(p, kCoordinateOnGrid)) return p;
#endif
    return Float3(snap_coordinate(p.x), snap_coordinate(p.y), snap_coordinate(p.z));
}

/// A direction component on the direction grid: a multiple of 2^-46 (2^-45 below 2^-23), never -0.
SHARED Float snap_direction_component(Float x) {
    PRECISE Float s = x + kDirectionSnap;
    PRECISE Float r = s - kDirectionSnap;
    return select(abs(x) >= kDirectionOnGrid, x, r);
}

/// 2^-k for 2^k <= x < 2^(k+1): the power of two that brings x into [1, 2). 2^-126 <= x < 2^127.
SHARED Float scale_to_unit(Float x) {
    return uintBitsToFloat(0x7F000000u - (floatBitsToUint(x) & 0x7F800000u));
}

/// 2^k for 2^k <= x < 2^(k+1): the inverse of scale_to_unit.
SHARED Float power_of_two_below(Float x) {
    return uintBitsToFloat(floatBitsToUint(x) & 0x7F800000u);
}

SHARED Float largest_component(Float3 v) { return greater(greater(abs(v.x), abs(v.y)), abs(v.z)); }

/// The axis of the largest component, the first of equal ones.
SHARED Uint largest_axis(Float3 v) {
    Float3 size = Float3(abs(v.x), abs(v.y), abs(v.z));
    return select(size.x >= size.y && size.x >= size.z, 0u, select(size.y >= size.z, 1u, 2u));
}

/// A direction scaled by a power of two to a largest component in [1, 2), on the grid; or 0.
SHARED Float3 canonical_direction(Float3 d) {
    Float largest = largest_component(d);
    PRECISE Float s = select(largest > 0.0f, scale_to_unit(largest), 1.0f);
    PRECISE Float3 scaled = Float3(d.x * s, d.y * s, d.z * s);
#ifdef SHARED_LANES
    if (all_beyond(scaled, kDirectionOnGrid)) return scaled;
#endif
    return Float3(snap_direction_component(scaled.x), snap_direction_component(scaled.y),
                  snap_direction_component(scaled.z));
}

SHARED_END

#endif  // per Float type
