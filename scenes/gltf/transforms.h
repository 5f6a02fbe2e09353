// Affine maps, rotations and values between keys, with the same bits on every machine.
#pragma once

#include <array>

#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

namespace mray::gltf {

/// Maps p to column[0] * p.x + column[1] * p.y + column[2] * p.z + column[3].
struct Affine {
    std::array<glm::dvec3, 4> column = {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0, 0, 0}}};
};

/// Translation, rotation (a quaternion x, y, z, w of length 1) and scale, applied from the last to
/// the first.
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

Affine affine_of(const Trs& trs);

/// The dot product, summed from x to w.
double dot(const glm::dvec4& a, const glm::dvec4& b);

/// The quaternion of length 1 in the direction of q. The identity if q has no direction.
glm::dvec4 unit_quaternion(const glm::dvec4& q);

/// Spherical linear interpolation along the shorter arc from a (u = 0) to b (u = 1), both of length
/// 1, without sines: an error below 1e-15 (derivation in transforms.cpp).
///
/// Based on: D. Eberly. A Fast and Accurate Algorithm for Computing SLERP. Journal of Graphics,
/// GPU, and Game Tools 15(3), 2011. Its series is summed after the arc has been halved five times.
glm::dvec4 slerp(const glm::dvec4& a, const glm::dvec4& b, double u);

/// The weights of value, out-tangent, next value and next in-tangent of a cubic Hermite spline at u
/// in [0, 1] of an interval of `seconds` (glTF 2.0, appendix C).
std::array<double, 4> hermite_weights(double u, double seconds);

}  // namespace mray::gltf
