// Whether two triangles cross, exactly.
#pragma once

#include <array>

#include "common/interop/platform.h"

namespace mray {

/// Whether two triangles of finite corners have a point in common that lies on no vertex and on no
/// edge that both have, by position. Exact for the coordinates given, in any space. A triangle
/// without area is a segment or a point. Some microseconds where doubles cannot decide.
/// docs/guide/queries.md, "Where a mesh passes through itself".
bool triangles_cross(const std::array<vec3, 3>& a, const std::array<vec3, 3>& b);

}  // namespace mray
