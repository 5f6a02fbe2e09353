// Transformations in long double, as the specification writes them, to compare with.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>

namespace mray::test {

using Real = long double;
using Point3 = std::array<Real, 3>;
using Quaternion = std::array<Real, 4>;  // x, y, z, w

inline Real dot(const Quaternion& a, const Quaternion& b) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3];
}

inline Quaternion unit(const Quaternion& q) {
    const Real length = std::sqrt(dot(q, q));
    return {q[0] / length, q[1] / length, q[2] / length, q[3] / length};
}

/// A turn by an angle about an axis, which needs no length of 1.
inline Quaternion turn(const Point3& axis, Real angle) {
    const Real length = std::sqrt(axis[0] * axis[0] + axis[1] * axis[1] + axis[2] * axis[2]);
    const Real s = std::sin(angle / 2) / length;
    return {axis[0] * s, axis[1] * s, axis[2] * s, std::cos(angle / 2)};
}

/// Spherical interpolation by an angle and sines (glTF 2.0, appendix C.4). An arc cosine would lose
/// the angle of quaternions that are close together.
inline Quaternion exact_slerp(const Quaternion& a, const Quaternion& b, Real u) {
    const Real d = dot(a, b);
    const Real sign = d < 0 ? -1 : 1;
    Quaternion sum = {};
    Quaternion difference = {};
    for (std::size_t k = 0; k < 4; ++k) {
        sum[k] = a[k] + sign * b[k];
        difference[k] = a[k] - sign * b[k];
    }
    const Real angle =
        2 * std::atan2(std::sqrt(dot(difference, difference)), std::sqrt(dot(sum, sum)));
    if (angle == 0) return a;
    const Real from = std::sin((1 - u) * angle) / std::sin(angle);
    const Real to = sign * std::sin(u * angle) / std::sin(angle);
    Quaternion result = {};
    for (std::size_t k = 0; k < 4; ++k) result[k] = from * a[k] + to * b[k];
    return result;
}

/// q * p * q^-1 for a quaternion of length 1: p + 2 w (v x p) + 2 v x (v x p).
inline Point3 rotated(const Quaternion& q, const Point3& p) {
    const auto cross = [](const Point3& a, const Point3& b) {
        return Point3{a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2],
                      a[0] * b[1] - a[1] * b[0]};
    };
    const Point3 v = {q[0], q[1], q[2]};
    const Point3 once = cross(v, p);
    const Point3 twice = cross(v, once);
    Point3 result = {};
    for (std::size_t k = 0; k < 3; ++k) result[k] = p[k] + 2 * q[3] * once[k] + 2 * twice[k];
    return result;
}

struct Placement {
    Point3 translation = {0, 0, 0};
    Quaternion rotation = {0, 0, 0, 1};
    Point3 scale = {1, 1, 1};
};

/// Scale, then rotation, then translation.
inline Point3 placed(const Placement& placement, Point3 p) {
    for (std::size_t k = 0; k < 3; ++k) p[k] *= placement.scale[k];
    p = rotated(placement.rotation, p);
    for (std::size_t k = 0; k < 3; ++k) p[k] += placement.translation[k];
    return p;
}

}  // namespace mray::test
