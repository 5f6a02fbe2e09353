// The triangle that is exactly the closest to a point, and the place on it.
//
// Floats (common/interop/closest_rule.h) give about the distance, and a place beside the closest
// one that is as far for them. Here doubles with error bounds decide, and integers of any length
// where the bounds overlap (docs/design/arithmetic.md, "Distances").
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include <glm/vec3.hpp>

#include "common/bvh/bvh.h"

namespace mray {

using glm::dvec3;
using Corners = std::array<vec3, 3>;

/// The point of a triangle that is closest to another one, in scene space.
struct ExactPlace {
    /// The barycentric weights of the corners, exactly 0 for corners that have no part in it.
    std::array<double, 3> weights;
    dvec3 point;
};

/// The place on a triangle that is closest to p: right to some ulps of the largest coordinate of a
/// corner, and exactly the weights that are 0 are 0. All numbers are finite; no coordinate of p is
/// above 2^300.
ExactPlace exact_place(const dvec3& p, const Corners& corners);

/// The distance of p from a triangle by the weights of exact_place(); 0 where doubles may be off by
/// more than 2^-24 of it, and on the triangle.
double distance_in_doubles(const dvec3& p, const Corners& corners,
                           const std::array<double, 3>& weights);
/// The distance of p from a triangle in any space, rounded a few times; 0 on the triangle alone.
double exact_distance_of(const dvec3& p, const Corners& corners);

struct NumberedTriangle {
    std::uint32_t prim_id;
    Corners corners;
};
NumberedTriangle triangle_of(const Leaf& leaf, std::uint32_t slot);

/// The closest triangle by a tree at the current positions, the lowest prim_id of equally close
/// ones; kNoPrim without triangles.
NumberedTriangle exact_closest(const Bvh& bvh, const dvec3& p);

/// The closest one of some triangles, of which there is one at least, as above.
NumberedTriangle exact_closest(const dvec3& p, std::span<const NumberedTriangle> triangles);

}  // namespace mray
