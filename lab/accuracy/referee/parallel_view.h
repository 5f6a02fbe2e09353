// The triangles that lines parallel to a ray meet, within a given distance of the ray.
#pragma once

#include <cstdint>
#include <vector>

#include "lab/accuracy/referee/exact_referee.h"

namespace mray::accuracy {

/// Triangles projected along a ray onto a plane across it, in double. A vertex has one projection
/// for all its triangles, so a closed mesh stays closed.
class ParallelView {
public:
    explicit ParallelView(const Ray& ray);

    /// Adds a triangle. Triangles without an extent across the ray have no effect.
    void add(std::uint32_t prim_id, vec3 a, vec3 b, vec3 c);

    /// Whether, in a spot at most `radius` away from the ray, no triangle is more than `ulps` (of a
    /// float) of t in front of prim_id, or, if that is kNoPrim, there is no triangle at all. Hits
    /// count at t > 0 within the ray's [tnear, tfar]. Spots narrower than about 2^-16 of the radius
    /// are ignored.
    bool shows(std::uint32_t prim_id, double radius, double ulps) const;

    /// Whether an edge of a triangle is at most `radius` away from the ray at a t in range that is
    /// no more than `ulps` larger than most_t. This is the test for triangles without an extent
    /// across the ray.
    bool grazes(vec3 a, vec3 b, vec3 c, double radius, double most_t, double ulps) const;

private:
    struct Seen {
        std::uint32_t prim_id;
        /// x, y across the ray; z along it in units of t.
        std::array<dvec3, 3> corner;
    };

    dvec3 seen(vec3 p) const;

    Ray ray_;
    dvec3 x_, y_, along_;
    std::vector<Seen> triangles_;
};

}  // namespace mray::accuracy
