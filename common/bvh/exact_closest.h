// The triangle that is exactly the closest to a point, and the place on it.
//
// From a distance that is not small, floats (common/interop/closest_rule.h) give a right distance,
// but a place beside the closest one that is as far for them. This decides in doubles with bounds
// of their errors, and in integers of any length between triangles that these leave open.
// docs/design/arithmetic.md, "Distances".
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <vector>

#include <glm/vec3.hpp>

#include "common/bvh/bvh.h"

namespace mray {

using glm::dvec3;
using Corners = std::array<vec3, 3>;

/// The point of a triangle that is closest to another one, in scene space.
struct ExactPlace {
    /// Those of the corners, 0 exactly for corners that have no part in it.
    std::array<double, 3> weights;
    dvec3 point;
};

/// Squared distances in scene space above this are far: 1/8 of the largest scene. The place that
/// floats give may then be beside the closest one, by a thousandth of the distance.
inline constexpr double kFarDistance2 = 0x1p+36;

/// Right to some ulps of the largest coordinate of a corner, and its weights are 0 where they are.
/// All are finite; no coordinate of p is above 2^300.
ExactPlace exact_place(const dvec3& p, const Corners& corners);

/// The closest triangle to a point among some, the lowest prim_id of equally close ones.
class ClosestChoice {
public:
    /// `lower` and `upper` are those of a box around the triangles.
    ClosestChoice(const dvec3& p, vec3 lower, vec3 upper);

    /// A lower bound, by which boxes may be visited in order.
    double least(vec3 lower, vec3 upper) const;
    /// Whether something with this lower bound may be the closest.
    bool is_open(double least) const { return least <= most_; }
    void add(std::uint32_t prim_id, const Corners& corners);
    /// kNoPrim if none was added.
    std::uint32_t closest() const;

private:
    struct Candidate {
        double least;
        std::uint32_t prim_id;
        Corners corners;
        /// Whether corners have weights that should, and no others.
        bool is_certain;
        std::array<double, 3> weights;
    };

    void set_middle(const dvec3& middle);
    /// A lower bound that is tight for triangles near the middle.
    double least_from_middle(const Corners& corners) const;

    dvec3 p_;
    /// Bounds are differences of squared distances from that of this place, which keeps their
    /// digits from far away.
    dvec3 reference_;
    double most_ = std::numeric_limits<double>::infinity();
    /// The closest place so far, the way from there to p, and a lower bound for it.
    dvec3 middle_;
    dvec3 to_p_;
    double least_of_middle_;
    std::vector<Candidate> candidates_;
};

/// The closest triangle by a tree at the current positions. `guess`, if there is one, is a triangle
/// to begin with.
std::uint32_t exact_closest(const Bvh& bvh, const dvec3& p, std::uint32_t guess,
                            const Corners& of_guess);

}  // namespace mray
