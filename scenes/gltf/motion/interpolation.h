// Values between the keys of an animation, the same bits on every machine.
#pragma once

#include <array>

#include <glm/vec4.hpp>

namespace mray::gltf {

/// The dot product, summed from x to w.
double dot(const glm::dvec4& a, const glm::dvec4& b);

/// The quaternion of length 1 in the direction of q. The identity if q has no direction.
glm::dvec4 unit_quaternion(const glm::dvec4& q);

/// Spherical linear interpolation along the shorter arc from a (u = 0) to b (u = 1), both of length
/// 1, without sines: an error below 1e-15 (derivation in interpolation.cpp).
///
/// Based on: D. Eberly. A Fast and Accurate Algorithm for Computing SLERP. Journal of Graphics,
/// GPU, and Game Tools 15(3), 2011. Its series is summed after the arc has been halved five times.
glm::dvec4 slerp(const glm::dvec4& a, const glm::dvec4& b, double u);

/// The weights of value, out-tangent, next value and next in-tangent of a cubic Hermite spline at u
/// in [0, 1] of an interval of `seconds` (glTF 2.0, appendix C).
std::array<double, 4> hermite_weights(double u, double seconds);

}  // namespace mray::gltf
