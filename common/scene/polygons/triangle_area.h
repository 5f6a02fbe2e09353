// Which triangles have no area.
#pragma once

#include "common/interop/platform.h"

namespace morphray {

/// Whether a triangle has an area. It has none where its vertices are collinear and the differences
/// of their coordinates are floats or do not matter, and then certainly so; elsewhere it counts as
/// having one. Coordinates are those of scene space.
bool has_area(vec3 a, vec3 b, vec3 c);

}  // namespace morphray
