// Makes cases from seeds: shapes on which tracers fail, their motions, and points, rays, cameras
// and lights at which they fail.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/scene/camera_setup.h"
#include "common/scene/mesh.h"
#include "common/scene/scene_space.h"
#include "tests/fuzz/case.h"
#include "tests/fuzz/generate/dice.h"

namespace mray::fuzz {

struct Shape {
    std::vector<dvec3> positions;
    std::vector<uvec3> triangles;
};

/// A shape of any kind, mostly of 1 to 40 triangles, rarely of up to 2000.
Shape make_shape(Dice& dice);

/// Writes triangles, poses, the frame and the pose that the tree is built at: a shape that moves in
/// some way, at some scale and offset, or a small built-in scene.
void make_animation(Dice& dice, FuzzCase& fuzz_case);

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

/// Points on a mesh and within ulps of it, on the planes and lines of its triangles, above and
/// below its vertices and edges, anywhere and far away, with large, tiny, denormal and rarely
/// infinite coordinates and NaN.
std::vector<vec3> make_points(Dice& dice, const Surroundings& around, std::size_t count);

/// Groups of points near each other, one after the other: `size` at and around each of
/// make_points().
std::vector<vec3> make_groups(Dice& dice, const Surroundings& around, std::size_t groups,
                              std::size_t size);

/// An image of at most `tests` ray-triangle tests of brute force.
ViewSpec make_view(Dice& dice, const Surroundings& around, double tests);

/// Rays at vertices, edges and along planes, many of which start on a surface or just off it.
std::vector<WorldRay> make_rays(Dice& dice, const Surroundings& around, std::size_t count);

/// Groups of rays from one place each to places near each other.
std::vector<WorldRay> make_ray_groups(Dice& dice, const Surroundings& around, std::size_t groups,
                                      std::size_t size);

/// A pure function of the seed. make_image_params() may refuse the view.
FuzzCase make_case(std::uint64_t seed);

/// A case of questions alone: a pure function of the seed. In one of four cases the rays, or the
/// points, come in groups, so many that they are asked about together.
FuzzCase make_questions(std::uint64_t seed);

/// The seed of a campaign's case.
std::uint64_t case_seed(std::uint64_t campaign_seed, std::uint64_t index);

}  // namespace mray::fuzz
