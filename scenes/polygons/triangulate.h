// Polygons to triangles.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/interop/platform.h"
#include "common/scene/mesh.h"

namespace mray {

/// Face i has corner_counts[i] >= 3 corners; all corners follow one another in `corners`.
struct Polygons {
    std::vector<std::uint32_t> corners;
    std::vector<std::uint32_t> corner_counts;
    bool operator==(const Polygons&) const = default;
};

/// Returns the triangles of all faces in their order, n - 2 for a face of n corners, with its
/// winding: a fan from the first corner if that covers the face, otherwise ears of its projection
/// along its normal, so that concave faces are covered correctly. Faces without a correct
/// triangulation (no area, corners that are not finite, crossing edges) get some n - 2 triangles of
/// their corners.
///
/// If `corners_of_triangles` is not null, the indices of the triangles' corners in
/// Polygons::corners are appended to it.
std::vector<uvec3> triangulate(const Polygons& faces, std::span<const vec3> positions,
                               std::vector<uvec3>* corners_of_triangles = nullptr);

}  // namespace mray
