// Numbers of 48 digits: unevaluated sums of two floats.
//
// Based on: M. Joldes, J.-M. Muller, V. Popescu. Tight and rigorous error bounds for basic building
// blocks of double-word arithmetic. ACM TOMS 44(2), 2017.
//
// With e = 2^-24, a sum is off by 3 e^2 of itself and a product by 8 e^2, and terms of e^3
// (lab/proofs/place.g). Parts of differences of coordinates are multiples of 2^-40, and parts of
// products are multiples of the products of their grids, so that no denormal arises
// (docs/design/arithmetic.md, "No denormals").
#if !defined(COMMON_INTEROP_PAIRS_H) || defined(SHARED_LANES)
#ifndef COMMON_INTEROP_PAIRS_H
#define COMMON_INTEROP_PAIRS_H

#include "common/interop/arithmetic.h"

#endif

SHARED_BEGIN

/// hi + lo, with |lo| at most half an ulp of hi.
struct Pair {
    Float hi, lo;
};

struct Pair3 {
    Float3 hi, lo;
};

SHARED Pair pair_of(Float hi, Float lo) {
    Pair r;
    r.hi = hi;
    r.lo = lo;
    return r;
}

SHARED Pair pair_x(Pair3 v) { return pair_of(v.hi.x, v.lo.x); }
SHARED Pair pair_y(Pair3 v) { return pair_of(v.hi.y, v.lo.y); }
SHARED Pair pair_z(Pair3 v) { return pair_of(v.hi.z, v.lo.z); }
SHARED Pair negated(Pair a) { return pair_of(-a.hi, -a.lo); }

SHARED Pair3 pair_vector(Pair x, Pair y, Pair z) {
    Pair3 r;
    r.hi = Float3(x.hi, y.hi, z.hi);
    r.lo = Float3(x.lo, y.lo, z.lo);
    return r;
}

/// a - b, exactly.
SHARED Pair exact_difference(Float a, Float b) {
    PRECISE Float d = a - b;
    return pair_of(d, difference_error(a, b, d));
}

/// a + b, exactly, for |a| >= |b| or a = 0.
SHARED Pair exact_sum_of_ordered(Float a, Float b) {
    PRECISE Float s = a + b;
    PRECISE Float taken = s - a;
    PRECISE Float rest = b - taken;
    return pair_of(s, rest);
}

SHARED Pair pair_sum(Pair a, Pair b) {
    Pair high = exact_difference(a.hi, -b.hi);
    Pair low = exact_difference(a.lo, -b.lo);
    PRECISE Float c = high.lo + low.hi;
    Pair v = exact_sum_of_ordered(high.hi, c);
    PRECISE Float w = low.lo + v.lo;
    return exact_sum_of_ordered(v.hi, w);
}

SHARED Pair pair_product(Pair a, Pair b) {
    PRECISE Float p = a.hi * b.hi;
    PRECISE Float left = a.hi * b.lo;
    PRECISE Float right = a.lo * b.hi;
    PRECISE Float rest = product_error(a.hi, b.hi, p) + (left + right);
    return exact_sum_of_ordered(p, rest);
}

SHARED Pair pair_scaled(Pair a, Float b) {
    PRECISE Float p = a.hi * b;
    PRECISE Float rest = product_error(a.hi, b, p) + a.lo * b;
    return exact_sum_of_ordered(p, rest);
}

/// a b - c d.
SHARED Pair pair_minor(Pair a, Pair b, Pair c, Pair d) {
    return pair_sum(pair_product(a, b), negated(pair_product(c, d)));
}

SHARED Pair3 pair_difference(Float3 a, Float3 b) {
    return pair_vector(exact_difference(a.x, b.x), exact_difference(a.y, b.y),
                       exact_difference(a.z, b.z));
}

SHARED Pair3 pair_cross(Pair3 a, Pair3 b) {
    return pair_vector(pair_minor(pair_y(a), pair_z(b), pair_z(a), pair_y(b)),
                       pair_minor(pair_z(a), pair_x(b), pair_x(a), pair_z(b)),
                       pair_minor(pair_x(a), pair_y(b), pair_y(a), pair_x(b)));
}

SHARED Pair pair_dot(Pair3 a, Pair3 b) {
    return pair_sum(
        pair_sum(pair_product(pair_x(a), pair_x(b)), pair_product(pair_y(a), pair_y(b))),
        pair_product(pair_z(a), pair_z(b)));
}

SHARED Pair pair_dot(Pair3 a, Float3 b) {
    return pair_sum(pair_sum(pair_scaled(pair_x(a), b.x), pair_scaled(pair_y(a), b.y)),
                    pair_scaled(pair_z(a), b.z));
}

/// t d - way, on the grid of projected coordinates.
SHARED Pair way_on_ray(Pair t, Float d, Pair way) {
    Pair r = pair_sum(pair_scaled(t, d), negated(way));
    return pair_of(snap_projected(r.hi), snap_projected(r.lo));
}

/// Sets q to n / d, to some e^2 of itself; or to 0 below 2^-90. False, with any q, for d = 0 and
/// where the quotient is beyond 2^60.
SHARED Bool pair_quotient(Pair n, Pair d, OUT(Pair) q) {
    // Both are scaled to [1, 2), so that denormals are too small to change the result.
    Bool is_known = abs(d.hi) > 0.0f;
    Bool is_zero = n.hi == 0.0f;
    Float n_size = select(is_zero, 1.0f, abs(n.hi));
    Float d_size = select(is_known, abs(d.hi), 1.0f);
    Float n_scale = scale_to_unit(n_size);
    Float d_scale = scale_to_unit(d_size);
    PRECISE Float high = d_size * d_scale;
    PRECISE Float low = select(d.hi < 0.0f, -d.lo, d.lo) * d_scale;
    PRECISE Float n_high = n.hi * n_scale;
    PRECISE Float n_low = n.lo * n_scale;
    Float r = rcp_of_positive(high);
    PRECISE Float whole = n_high * r;
    PRECISE Float p = whole * high;
    PRECISE Float rest = (n_high - p) - product_error(whole, high, p);
    PRECISE Float lower = n_low - whole * low;
    PRECISE Float correction = (rest + lower) * r;
    Pair sum = exact_sum_of_ordered(whole, correction);

    // 2^(exponent of n - exponent of d), within [2^-90, 2^60].
    Uint n_exponent = floatBitsToUint(n_size) >> 23u;
    Uint d_exponent = floatBitsToUint(d_size) >> 23u;
    Bool is_small = is_zero || n_exponent + 90u < d_exponent;
    is_known = is_known && n_exponent < d_exponent + 60u;
    Uint exponent = select(is_small || !is_known, 127u, n_exponent + 127u - d_exponent);
    Float scale = uintBitsToFloat(exponent << 23u);
    scale = select(d.hi < 0.0f, -scale, scale);
    PRECISE Float q_high = sum.hi * scale;
    PRECISE Float q_low = sum.lo * scale;
    q.hi = select(is_small, 0.0f, q_high);
    q.lo = select(is_small, 0.0f, q_low);
    return is_known;
}

/// A weight on the grid 2^-24, from 0 to 1.
SHARED Float grid_weight(Float w) {
    PRECISE Float moved = w + 0.5f;
    PRECISE Float back = moved - 0.5f;
    return lesser(greater(select(w < 0.5f, back, w), 0.0f), 1.0f);
}

SHARED_END

#endif  // per Float type
