// Intersects one ray with one triangle in exact arithmetic over their floats.
#pragma once

#include <array>
#include <glm/vec3.hpp>
#include <memory>

#include "common/interop/ray.h"

namespace mray::accuracy {

using glm::dvec3;

/// The intersection of a ray with a triangle in homogeneous form. With a, b, c the corners relative
/// to the origin and d the direction,
///     u = d . (b x c),   v = d . (c x a),   w = d . (a x b),   t = a . (b x c) / (u + v + w).
/// They are computed in double with a bound of their errors (as J. R. Shewchuk. Adaptive precision
/// floating-point arithmetic and fast robust geometric predicates. 1997, stage A), and by integers
/// of any length (GMP) if that does not decide.
class ExactTriangle {
public:
    /// Any finite floats.
    ExactTriangle(const Ray& ray, vec3 a, vec3 b, vec3 c);

    /// Whether the line meets the triangle, edges and corners included. Not if it lies in its
    /// plane, nor if the triangle has no area.
    bool is_met() const;
    /// Whether t is above 0 and within [tnear, tfar]. Only for a triangle that is met.
    bool in_range() const;
    /// The sign of t - other.t, exactly. Only for triangles whose planes the line crosses.
    int compare_t(const ExactTriangle& other) const;

    /// Whether the line crosses the plane, so that there is a t.
    bool has_t() const;
    /// t of the plane, to 2^-27 of itself.
    double t() const;
    /// How near the line is to the nearest edge, as a part of size(); in double.
    double edge_distance() const;
    /// The largest distance of a corner from the line.
    double size() const;

private:
    struct Integers;

    int sign_of_edge(int edge) const;
    int sign_of_sum() const;
    int compare_t(float limit) const;
    const Integers& integers() const;

    Ray ray_;
    std::array<vec3, 3> corners_;
    std::array<dvec3, 3> relative_;
    /// u, v, w, their sum, and a . (b x c); and the bounds of their errors.
    std::array<double, 5> value_;
    std::array<double, 5> error_;
    mutable std::shared_ptr<const Integers> integers_;
};

}  // namespace mray::accuracy
