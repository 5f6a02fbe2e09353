// The built-in scenes, one a file. Each takes about how many triangles to make and gives at least
// what the scene needs.
#pragma once

#include <cstdint>

#include "common/procedural/deforming_mesh.h"

namespace morphray {

/// A sheet that comes down waving over a ball and hangs around it in folds, above a plane.
DeformingMesh make_cloth(std::uint64_t triangles);

}  // namespace morphray
