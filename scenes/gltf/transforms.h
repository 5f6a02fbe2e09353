// Affine maps, rotations and values between keys, with the same bits on every machine.
#pragma once

#include <array>
#include <cmath>

#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

namespace mray::gltf {

/// Maps p to column[0] * p.x + column[1] * p.y + column[2] * p.z + column[3].
struct Affine {
    std::array<glm::dvec3, 4> column = {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0, 0, 0}}};
};

/// From 16 numbers, column by column. The last row is left out.
template <class Number>
Affine matrix_of(const Number* m) {
    Affine matrix;
    for (std::size_t k = 0; k < 4; ++k) matrix.column[k] = {m[4 * k], m[4 * k + 1], m[4 * k + 2]};
    return matrix;
}

/// Translation, rotation (a unit quaternion x, y, z, w) and scale, applied from last to first.
struct Trs {
    glm::dvec3 translation = {0, 0, 0};
    glm::dvec4 rotation = {0, 0, 0, 1};
    glm::dvec3 scale = {1, 1, 1};
};

inline glm::dvec3 linear_part(const Affine& a, const glm::dvec3& p) {
    return a.column[0] * p.x + a.column[1] * p.y + a.column[2] * p.z;
}
inline glm::dvec3 transformed(const Affine& a, const glm::dvec3& p) {
    return linear_part(a, p) + a.column[3];
}

/// The map that applies `b`, then `a`.
inline Affine product(const Affine& a, const Affine& b) {
    return {{linear_part(a, b.column[0]), linear_part(a, b.column[1]), linear_part(a, b.column[2]),
             transformed(a, b.column[3])}};
}

inline Affine affine_of(const Trs& trs) {
    const double x = trs.rotation.x;
    const double y = trs.rotation.y;
    const double z = trs.rotation.z;
    const double w = trs.rotation.w;
    Affine a;
    a.column[0] =
        glm::dvec3(1 - 2 * (y * y + z * z), 2 * (x * y + z * w), 2 * (x * z - y * w)) * trs.scale.x;
    a.column[1] =
        glm::dvec3(2 * (x * y - z * w), 1 - 2 * (x * x + z * z), 2 * (y * z + x * w)) * trs.scale.y;
    a.column[2] =
        glm::dvec3(2 * (x * z + y * w), 2 * (y * z - x * w), 1 - 2 * (x * x + y * y)) * trs.scale.z;
    a.column[3] = trs.translation;
    return a;
}

/// The dot product, summed from x to w.
inline double dot(const glm::dvec4& a, const glm::dvec4& b) {
    return a.x * b.x + a.y * b.y + a.z * b.z + a.w * b.w;
}

/// The quaternion of length 1 in the direction of q. The identity if q has no direction.
inline glm::dvec4 unit_quaternion(const glm::dvec4& q) {
    const double length = std::sqrt(dot(q, q));
    if (!(length > 0) || !std::isfinite(length)) return {0, 0, 0, 1};
    return q / length;
}

/// sin(u * angle) / sin(angle) for small angles, from x = cos(angle) - 1 above -0.00121
/// (docs/design/gltf.md has the derivation).
inline double sine_quotient(double u, double x) {
    constexpr int kTerms = 5;
    double sum = 1;
    for (int i = kTerms; i >= 1; --i)
        sum = 1 + sum * x *
                      ((u * u - static_cast<double>(i * i)) / static_cast<double>(i * (2 * i + 1)));
    return u * sum;
}

/// Spherical linear interpolation along the shorter arc from a (u = 0) to b (u = 1), both of length
/// 1, without sines: an error below 1e-15 (derivation above).
///
/// Based on: D. Eberly. A Fast and Accurate Algorithm for Computing SLERP. Journal of Graphics,
/// GPU, and Game Tools 15(3), 2011. Its series is summed after the arc has been halved five times.
inline glm::dvec4 slerp(const glm::dvec4& a, const glm::dvec4& b, double u) {
    constexpr int kHalvings = 5;
    if (u <= 0) return a;
    if (u >= 1) return b;
    glm::dvec4 from = a;
    glm::dvec4 to = dot(a, b) < 0 ? -b : b;
    // The middle of an arc is the direction of the sum of its ends; both changes of u are exact.
    for (int i = 0; i < kHalvings; ++i) {
        const glm::dvec4 middle = unit_quaternion(from + to);
        if (u < 0.5) {
            to = middle;
            u = 2 * u;
        } else {
            from = middle;
            u = 2 * u - 1;
        }
    }
    const glm::dvec4 chord = to - from;
    const double x = -0.5 * dot(chord, chord);
    return unit_quaternion(from * sine_quotient(1 - u, x) + to * sine_quotient(u, x));
}

/// The weights of value, out-tangent, next value and next in-tangent of a cubic Hermite spline at u
/// in [0, 1] of an interval of `seconds` (glTF 2.0, appendix C).
inline std::array<double, 4> hermite_weights(double u, double seconds) {
    const double u2 = u * u;
    const double u3 = u2 * u;
    return {2 * u3 - 3 * u2 + 1, seconds * (u3 - 2 * u2 + u), 3 * u2 - 2 * u3, seconds * (u3 - u2)};
}

}  // namespace mray::gltf
