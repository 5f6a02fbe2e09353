// The distance of a triangle from a point, in doubles with error bounds and in exact numbers.
#pragma once

#include <gmpxx.h>

#include <array>

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
Difference difference(const dvec3& p, const dvec3& r, const dvec3& q, double blur);

/// The closest place of a triangle in doubles.
struct DoublePlace {
    ExactPlace place;
    /// True if exact numbers give 0 for the same weights.
    bool is_certain = false;
};
/// The place, and its squared distance less that of r.
DoublePlace place_in_doubles(const dvec3& p, const dvec3& r, const Corners& corners,
                             Difference& distance);

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
