// Points at which tracers fail: on a mesh, in its planes, just off them, far away.
#pragma once

#include <span>
#include <vector>

#include "common/scene/mesh.h"
#include "tests/fuzz/generate/dice.h"

namespace mray::fuzz {

/// The triangles, vertices and extent of a pose in world space, from which points are chosen.
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
dvec3 special_place(Dice& dice, const Surroundings& around);

/// A point in the plane of the triangle; and a point 2^-last to 2^-first extents off it.
dvec3 place_in_plane(Dice& dice, const Surroundings::Corners& triangle);
dvec3 place_off_plane(Dice& dice, const Surroundings& around, const Surroundings::Corners& triangle,
                      int first, int last);

/// A target of a camera or ray: a vertex, the middle of an edge, a point of a face, or any point.
dvec3 special_target(Dice& dice, const Surroundings& around);

}  // namespace mray::fuzz
