// Normals for smooth shading, which follow the deformation.
#pragma once

#include "common/scene/mesh.h"

namespace mray {

/// Stands for the index of a vertex normal at the corner of a triangle that is flat there.
inline constexpr std::uint32_t kFlatCorner = 0xFFFFFFFFu;

class VertexNormals {
public:
    /// Three indices for each triangle, or kFlatCorner. Memory is taken up to the largest.
    VertexNormals(std::span<const uvec3> triangles, std::span<const uvec3> ids);

    /// Sets the normals: unit vectors of sums over their corners, in the order of prim_id: the unit
    /// normal of the triangle times the angle of the corner; 0 where the sum is 0 (G. Thürmer, C.
    /// A. Wüthrich. Computing Vertex Normals from Polygonal Facets. JGT 3(1), 1998). Triangles
    /// without an area or with a vertex that is not finite count as 0. Runs in the calling thread's
    /// arena; the bits do not depend on the number of threads. O(triangles).
    void update(std::span<const vec3> positions);

    std::span<const uvec3> ids() const { return ids_; }
    std::span<const vec3> normals() const { return normals_; }
    /// Differs for other normals or ids, also of other objects, for copies of them.
    std::uint64_t version() const { return version_; }

private:
    std::uint64_t version_ = 0;
    std::vector<uvec3> triangles_, ids_;
    /// The corners of normal i are users_[begins_[i]] up to users_[begins_[i + 1]]: 3 * prim_id,
    /// and the number of the corner.
    std::vector<std::uint32_t> begins_, users_;
    /// For each corner.
    std::vector<vec3> weighted_;
    std::vector<vec3> normals_;
};

}  // namespace mray
