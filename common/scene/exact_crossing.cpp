#include "common/scene/exact_crossing.h"

#include <gmpxx.h>

#include <algorithm>
#include <cmath>
#include <iterator>

namespace mray {
namespace {

/// A vector in units of the least float, 2^-149.
struct Vector {
    mpz_class x;
    mpz_class y;
    mpz_class z;
};

/// Exact: a double has room for the digits and the exponent.
mpz_class integer(float x) { return mpz_class(std::ldexp(static_cast<double>(x), 149)); }

Vector offset(vec3 from, vec3 to) {
    return {integer(to.x) - integer(from.x), integer(to.y) - integer(from.y),
            integer(to.z) - integer(from.z)};
}

Vector cross(const Vector& a, const Vector& b) {
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

/// The sign of the edge function of a and b, which is `sign`, for the moved point.
int moved_sign(int sign, vec3 a, vec3 b) {
    if (sign != 0) return sign;
    if (a.y != b.y) return a.y > b.y ? 1 : -1;
    if (a.x != b.x) return b.x > a.x ? 1 : -1;
    return 0;
}

bool any_opposite(const mpz_class& a, const mpz_class& b, const mpz_class& c) {
    const int signs[3] = {sgn(a), sgn(b), sgn(c)};
    const auto [least, most] = std::minmax_element(std::begin(signs), std::end(signs));
    return *least < 0 && *most > 0;
}

bool is_in_box(vec3 p, vec3 a, vec3 b, vec3 c) {
    for (int axis = 0; axis < 3; ++axis) {
        if (p[axis] < std::min({a[axis], b[axis], c[axis]}) ||
            p[axis] > std::max({a[axis], b[axis], c[axis]}))
            return false;
    }
    return true;
}

}  // namespace

ExactCrossing exact_crossing(vec3 p, vec3 a, vec3 b, vec3 c) {
    const Vector ra = offset(p, a);
    const Vector rb = offset(p, b);
    const Vector rc = offset(p, c);
    // Edge functions, opposite to a, b and c, in the planes of two axes.
    const Vector u = cross(rb, rc);
    const Vector v = cross(rc, ra);
    const Vector w = cross(ra, rb);
    int height = sgn(u.z * ra.z + v.z * rb.z + w.z * rc.z);
    ExactCrossing crossing;
    // In the plane of the triangle, and not outside of it in any of three projections. Where the
    // triangle has no area its corners are on a line, and so is p then.
    crossing.is_on_triangle = height == 0 && is_in_box(p, a, b, c) &&
                              !any_opposite(u.x, v.x, w.x) && !any_opposite(u.y, v.y, w.y) &&
                              !any_opposite(u.z, v.z, w.z);
    const int side = moved_sign(sgn(u.z), b, c);
    if (side == 0 || moved_sign(sgn(v.z), c, a) != side || moved_sign(sgn(w.z), a, b) != side)
        return crossing;
    // The move changes the height by -(normal . move), and the normal's z has the sign `side`.
    if (height == 0) height = -sgn(u.x + v.x + w.x);
    if (height == 0) height = -sgn(u.y + v.y + w.y);
    if (height == 0) height = -side;
    if (height == side) crossing.sign = side;
    return crossing;
}

}  // namespace mray
