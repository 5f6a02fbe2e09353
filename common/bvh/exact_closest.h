// The triangle that is exactly the closest to a point, and the place on it: doubles with error
// bounds decide, and integers where the bounds overlap (docs/design/arithmetic.md, "Distances").
#pragma once

#include <functional>

#include "common/bvh/bvh.h"

namespace mray {

using glm::dvec3;
using Corners = std::array<vec3, 3>;

/// The most by which the distance of the rule of closest points exceeds the exact one, and falls
/// below it. Both are parts of the triangle's largest coordinate relative to the point. Checked:
/// lab/proofs/closest.g.
inline constexpr float kRuleExcess = 0x5p-20f;
inline constexpr float kRuleDefect = 0x1.8p-20f;
/// The most by which rounding a point changes two distances, as a part of its largest coordinate.
inline constexpr float kPointRounding = 0x1p-22f;

/// The point of a triangle that is closest to another one, in scene space.
struct ExactPlace {
    /// The barycentric weights of the corners, exactly 0 for corners that have no part in it.
    std::array<double, 3> weights;
    dvec3 point;
};

/// The place on a triangle that is closest to p, to some ulps of the largest coordinate of a
/// corner. Weights of 0 are exact. Numbers are finite, coordinates of p at most 2^300.
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

/// The closest triangle of a tree, the lowest prim_id of equally close ones; kNoPrim without any.
/// If `sees` is not empty, only triangles with sees(prim_id) exist.
NumberedTriangle exact_closest(const Bvh& bvh, const dvec3& p,
                               const std::function<bool(std::uint32_t prim_id)>& sees = {});

/// The closest one of some triangles, of which there is one at least, as above.
NumberedTriangle exact_closest(const dvec3& p, std::span<const NumberedTriangle> triangles);

}  // namespace mray
