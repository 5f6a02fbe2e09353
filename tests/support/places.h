// Places, points and rays in world space at which tracers and queries fail: on the vertices, edges
// and planes of a mesh, next to these, and far away.
#pragma once

#include <span>
#include <vector>

#include "common/scene/scene_space.h"
#include "tests/support/random.h"

namespace mray::test {

/// The triangles, vertices and extent of a pose.
struct Surroundings {
    Surroundings(std::span<const vec3> positions, std::span<const uvec3> triangles);

    struct Corners {
        dvec3 a, b, c;
    };
    /// Triangles whose vertices are all finite.
    std::vector<Corners> triangles;
    std::vector<dvec3> vertices;
    dvec3 centre = {0, 0, 0};
    /// The largest half side of the bounds; if that is 0, the distance from the origin, or 1.
    double extent = 1;
};

/// A point for an eye, a light or the origin of a ray: mostly in the plane of a triangle or up to
/// 2^-60 extents off it, inside or far outside the triangle; otherwise anywhere up to 1e6 extents
/// away.
dvec3 special_place(Random& random, const Surroundings& around);

/// A target of a camera or ray: a vertex, the middle of an edge, a point of a face, or any point.
dvec3 special_target(Random& random, const Surroundings& around);

/// From a special place to a special target. The direction has any length.
WorldRay special_ray(Random& random, const Surroundings& around);

/// Groups of rays from one place each to targets near each other.
std::vector<WorldRay> ray_groups(Random& random, const Surroundings& around, std::size_t groups,
                                 std::size_t size);

/// Points on a mesh and within ulps of it, on the planes and lines of its triangles, above and
/// below its vertices and edges, anywhere and far away, with large, tiny, denormal and rarely
/// infinite coordinates and NaN.
vec3 special_point(Random& random, const Surroundings& around);

/// Groups of points: `size` at and around each of some special points.
std::vector<vec3> point_groups(Random& random, const Surroundings& around, std::size_t groups,
                               std::size_t size);

}  // namespace mray::test
