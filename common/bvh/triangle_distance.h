// The distance of a triangle from a point, in doubles with error bounds and in exact numbers.
#pragma once

#include <gmpxx.h>

#include <array>
#include <cmath>

#include "common/bvh/exact_closest.h"

namespace mray {

// Bounds of the errors of a dozen roundings, by the largest number in them.
inline constexpr double kDistanceRounding = 0x1p-49;

/// Bounds of |p - q|^2 - |p - r|^2.
struct Difference {
    double value;
    double error;

    double least() const { return value - error; }
    double most() const { return value + error; }
};
/// As p and r are given; q is off by up to `blur` on each axis.
inline Difference difference(const dvec3& p, const dvec3& r, const dvec3& q, double blur) {
    Difference result{0, 0};
    for (int axis = 0; axis < 3; ++axis) {
        const double across = r[axis] - q[axis];
        const double from_q = p[axis] - q[axis];
        const double from_r = p[axis] - r[axis];
        const double size = std::abs(from_q) + std::abs(from_r);
        result.value += across * (from_q + from_r);
        result.error += (kDistanceRounding * std::abs(across) + 2 * blur + 0x1p-90 * size) * size;
    }
    result.error += 3 * blur * blur;
    return result;
}

/// The closest place of a triangle in doubles.
struct DoublePlace {
    ExactPlace place;
    /// True if exact numbers give 0 for the same weights.
    bool is_certain = false;
};
/// Finds the place on a triangle that is the closest one to p. Squared distances are compared after
/// that of the nearby point r is subtracted, which keeps their digits.
DoublePlace place_in_doubles(const dvec3& p, const dvec3& r, const Corners& corners);

/// The most by which a coordinate of a place in doubles differs from the exact one.
double blur_of(const Corners& corners);

/// Corners that have a part in a place, others as the first of them, in order.
using Feature = std::array<std::array<float, 3>, 3>;
Feature feature_of(const Corners& corners, const std::array<double, 3>& weights);

/// The closest place of a triangle in integers of any length.
struct ExactDistance {
    mpq_class distance2;
    /// The barycentric weights of the corners, times a common factor.
    std::array<mpz_class, 3> weights;
};
ExactDistance exact_distance(const dvec3& p, const Corners& corners);

}  // namespace mray
