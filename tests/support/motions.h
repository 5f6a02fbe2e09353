// Ways to move that are hard on a tree.
#pragma once

#include <string>
#include <vector>

#include "common/scene/mesh.h"
#include "tests/support/test_scene.h"

namespace mray::test {

/// A short animation in scene space.
struct Motion {
    std::string name;
    Topology topology;
    std::vector<std::vector<vec3>> poses;
    /// The pose that the first tree is built at.
    std::size_t build_at = 0;
};

/// Waves, cloth, 4 and 8 turns of a column, walking animals, orbits, explosion, gathering, shuffle,
/// collapse from the whole mesh and from a point, teleport, a swing around the point at
/// which a build pays, many meshes that fall apart in one frame, vertices that become NaN for a
/// while. Some hundred triangles and ten poses each.
std::vector<Motion> hard_motions();

}  // namespace mray::test
