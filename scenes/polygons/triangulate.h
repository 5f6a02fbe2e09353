// Polygons to triangles.
#pragma once

#include "common/scene/mesh.h"

namespace mray {

/// Face i has corner_counts[i] >= 3 corners; all corners follow one another in `corners`.
struct Polygons {
    std::vector<std::uint32_t> corners, corner_counts;
    bool operator==(const Polygons&) const = default;
};

/// Returns the triangles of all faces in their order, n - 2 for n corners, with their turn: a
/// fan if that covers the face, otherwise those of its projection along its normal. They cover what
/// it surrounds once, also where corners coincide and edges touch or lie on one another; those left
/// over have no area. A face without a correct triangulation (no area, crossing edges) and one of
/// more than 8192 corners gets some n - 2 triangles of its corners. If they are not null, appends
/// - to `corners_of_triangles` the triangles' indices in Polygons::corners,
/// - to `crossing` the faces that cross or are too large, counted among those of more than three
///   corners.
std::vector<uvec3> triangulate(const Polygons& faces, std::span<const vec3> positions,
                               std::vector<uvec3>* corners_of_triangles = nullptr,
                               std::vector<std::size_t>* crossing = nullptr);

}  // namespace mray
