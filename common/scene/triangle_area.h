// Tests whether a triangle has an area.
#pragma once

#include "common/interop/platform.h"

namespace mray {

/// Whether a triangle in scene space has an area. Returns false only if the vertices are certainly
/// collinear, which it proves if every rounding error in the differences of their coordinates is 0
/// or multiplied by 0; all other triangles count as having an area.
bool has_area(vec3 a, vec3 b, vec3 c);

}  // namespace mray
