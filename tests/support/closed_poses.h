// Poses of a closed mesh, and rays inside it at what leaks.
#pragma once

#include <vector>

#include "common/interop/ray.h"
#include "tests/support/test_scene.h"

namespace mray::test {

/// The vertices of a mesh around 0, each moved along its own way from 0 by up to a third: no two
/// triangles ever overlap as seen from 0.
std::vector<vec3> breathing(const std::vector<vec3>& positions, Random& random);

/// From near 0: at a vertex, at a point of an edge.
std::vector<Ray> rays_from_inside(const TestScene& scene, const std::vector<vec3>& positions,
                                  std::size_t count, Random& random);

}  // namespace mray::test
