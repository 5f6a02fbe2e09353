// Points at which methods fail: on a mesh, in its planes, hardly off them, far away.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "common/scene/mesh.h"
#include "tests/fuzz/generate/dice.h"

namespace morphray::fuzz {

/// What a pose (world space) is to those who choose points.
struct Surroundings {
    Surroundings(std::span<const vec3> positions, std::span<const uvec3> triangles);

    struct Corners {
        dvec3 a, b, c;
    };
    /// Those whose vertices are all finite.
    std::vector<Corners> triangles;
    std::vector<dvec3> vertices;
    dvec3 centre = {0, 0, 0};
    /// The largest half side of the bounds; where that is 0, the distance from the origin, or 1.
    double extent = 1;
};

struct Place {
    dvec3 point = {0, 0, 0};
    std::string what;
};

/// For an eye, a light or the origin of a ray: mostly in the plane of a triangle or up to 2^-60
/// extents off it, inside or far outside of the triangle, else anywhere up to 1e6 extents away.
Place special_place(Dice& dice, const Surroundings& around);

/// In the plane of this triangle; and up to 2^-last extents off it, 2^-first at most.
Place place_in_plane(Dice& dice, const Surroundings::Corners& triangle);
Place place_off_plane(Dice& dice, const Surroundings& around, const Surroundings::Corners& triangle,
                      int first, int last);

/// Something to look at: a vertex, the middle of an edge, a point of a face, anything.
dvec3 special_target(Dice& dice, const Surroundings& around);

}  // namespace morphray::fuzz
