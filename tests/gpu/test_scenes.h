// Small scenes with difficult hits, and trees over them that the builder has no part in.
#pragma once

#include <span>
#include <vector>

#include "common/bvh/bvh.h"
#include "common/interop/params.h"
#include "common/interop/ray.h"
#include "common/scene/mesh.h"

namespace mray::test {

struct DeviceScene {
    const char* name;
    Topology topology;
    std::vector<vec3> positions;  // scene space
};

/// A closed torus of 2 * rings * sides triangles.
DeviceScene torus(std::uint32_t rings, std::uint32_t sides);
/// Triangles of all sizes and shapes: needles, slivers, points, and vertices that are not finite.
DeviceScene debris(std::uint32_t count, std::uint32_t seed);
/// The same triangle `count` times, so that no box can be culled.
DeviceScene coincident(std::uint32_t count);
/// Pairs of triangles of all slopes with small distances, down to less than the bound of a hit's
/// depth.
DeviceScene layers(std::uint32_t pairs, std::uint32_t seed);
/// A floor, and on it a wall of strips with gaps. The strips are so narrow for their distance that
/// the fast filter is often uncertain whether a ray goes through one.
DeviceScene strips(std::uint32_t rows, std::uint32_t columns, std::uint32_t seed);
/// A floor, and long narrow triangles that pass the light and the eye of view(), at distances of
/// 2^-14 to 1 units: as these see them, most have no certain orientation.
DeviceScene beams(std::uint32_t count, std::uint32_t seed);
/// All scenes above but the last three.
std::vector<DeviceScene> test_scenes();

/// Vertices swayed by a smooth motion of size `amount`; those that are not finite stay so.
std::vector<vec3> swayed(const DeviceScene& scene, float time, float amount = 0.3f);

/// A correct tree of bad quality: triangles in order, five a leaf, sixteen children a node.
Bvh plain_tree(const DeviceScene& scene);

/// A view of the scenes above, all of which lie within 4 of the origin (in units of 2^16).
ImageParams view(std::uint32_t width, std::uint32_t height, std::uint32_t rays,
                 std::uint32_t ao_count = 4);

/// Rays from any place to any place, some along axes, some with tnear and tfar, some with a
/// direction of 0.
std::vector<Ray> scattered_rays(std::size_t count, std::uint32_t seed);

}  // namespace mray::test
