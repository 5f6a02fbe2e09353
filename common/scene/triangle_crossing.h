// Whether two triangles cross, exactly.
#pragma once

#include <array>

#include "common/interop/platform.h"

namespace mray {

/// The largest error of certain signs of triple products of differences of floats in doubles, as a
/// part of the sum of the sizes of their products. Checked: lab/proofs/planes.g.
inline constexpr double kSideRounding = 0x1p-49;
/// The largest such error of dot products of any vector and a difference.
inline constexpr double kPlaneRounding = 0x1p-50;

/// Whether two triangles of finite corners have a point in common that lies on no vertex and on no
/// edge that both have, by position. Exact for the coordinates given, in any space. A triangle
/// without area is a segment or a point. Some microseconds where doubles cannot decide.
/// docs/guide/queries.md, "Where a mesh passes through itself".
bool triangles_cross(const std::array<vec3, 3>& a, const std::array<vec3, 3>& b);

}  // namespace mray
