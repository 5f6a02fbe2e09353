// Polygons to triangles.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "common/interop/platform.h"
#include "common/scene/mesh.h"
#include "scenes/warning_count.h"

namespace mray {

/// Face i has corner_counts[i] >= 3 corners; all corners follow one another in `corners`.
struct Polygons {
    std::vector<std::uint32_t> corners;
    std::vector<std::uint32_t> corner_counts;
    bool operator==(const Polygons&) const = default;
};

/// A polygon of n corners may take this times n steps. A simple polygon of fewer than 2,500 corners
/// never takes as many. 200,000 corners are refused within seconds.
inline constexpr std::size_t kTriangulationStepsPerCorner = 5000;

/// Returns the triangles of all faces in their order, n - 2 for a face of n corners, with its
/// winding: a fan from the first corner if that covers the face, otherwise ears of its projection
/// along its normal, so that concave faces are covered correctly. Faces without a correct
/// triangulation (no area, corners that are not finite, crossing edges) get some n - 2 triangles of
/// their corners.
///
/// A face that takes too many steps (above) throws Error(kBadInput), or if lenient becomes a fan
/// with a warning; `name` is the file in messages. If `corners_of_triangles` is not null, the
/// indices of the triangles' corners in Polygons::corners are appended to it.
std::vector<uvec3> triangulate(const Polygons& faces, std::span<const vec3> positions,
                               const std::string& name, bool lenient, const WarnFunction& warn,
                               std::vector<uvec3>* corners_of_triangles = nullptr);

}  // namespace mray
