// Closed meshes with T-joints, triangles without area and collapsed vertices.
#pragma once

#include "tests/support/test_scene.h"

namespace mray::test {

/// A sphere of radius 1 around `centre` in which `joints` times an edge gets a vertex that only one
/// of its two triangles uses, and a triangle fills the crack; after that `collapses` vertices are
/// moved to a neighbour. Each directed edge has its opposite, so the mesh is closed; float rounding
/// at `centre` makes fillers, and other triangles, collinear. Positions are multiplied by `scale`.
TestScene sphere_with_joints(int levels, std::uint32_t joints, std::uint32_t collapses,
                             double scale, const vec3& centre, std::uint64_t seed);

/// Whether each directed edge of the triangles has as many opposites.
bool is_closed(const std::vector<uvec3>& triangles);

/// From near `centre` (scene space): at vertices, at points of edges, at places inside triangles.
std::vector<Ray> rays_at_joints(const TestScene& scene, const vec3& centre, double scale,
                                std::size_t count, Random& random);

}  // namespace mray::test
