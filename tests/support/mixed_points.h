// Points in scene space on which questions about meshes fail: in the room around a mesh, at and
// next to its vertices, edges and triangles, on its planes and lines.
#pragma once

#include <cstdint>
#include <vector>

#include "tests/support/test_scene.h"

namespace mray::test {

std::vector<vec3> mixed_points(const std::vector<uvec3>& triangles,
                               const std::vector<vec3>& positions, std::size_t count,
                               std::uint64_t seed);

}  // namespace mray::test
