// Polygons to triangles.
#pragma once

#include <span>
#include <string>

#include "common/base/warning_count.h"
#include "common/interop/platform.h"
#include "common/scene/mesh.h"
#include "common/scene/polygons/polygons.h"

namespace morphray {

/// A polygon of n corners may take this times n steps; a simple polygon of fewer than 150 corners
/// never does, a larger one only if it is made to. 200,000 corners are refused within seconds.
inline constexpr std::size_t kTriangulationStepsPerCorner = 500;

/// Triangles of all faces in their order, n - 2 of a face of n corners, wound as the face is: a fan
/// from the first corner where that covers the face, otherwise ears of its projection along its
/// normal, so that concave faces come out right. Faces that have no right triangulation (no area,
/// corners that are not finite, crossing edges) get some n - 2 triangles of their corners.
///
/// A face that takes too many steps (above) throws Error(kBadInput), or if lenient becomes a fan
/// with a warning; `name` is the file in messages.
std::vector<uvec3> triangulate(const Polygons& faces, std::span<const vec3> positions,
                               const std::string& name, bool lenient, const WarnFunction& warn);

}  // namespace morphray
