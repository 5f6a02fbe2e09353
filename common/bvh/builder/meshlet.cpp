#include "common/bvh/builder/meshlet.h"

#include <algorithm>

#include "common/bvh/builder/vertex_set.h"

namespace mray {

bool find_leaf_shape(const Topology& topology, std::span<const std::uint32_t> prim_ids,
                     LeafShape& shape) {
    const auto count = static_cast<std::uint32_t>(prim_ids.size());
    VertexSet set;
    for (std::uint32_t i = 0; i < count; ++i) {
        const uvec3 t = topology.triangles[prim_ids[i]];
        const std::uint32_t a = set.add(t.x);
        const std::uint32_t b = set.add(t.y);
        const std::uint32_t c = set.add(t.z);
        if (set.vertices().size() > kLeafVertices) return false;
        shape.corners[i] = pack_corners(a, b, c, count);
    }
    const std::span<const std::uint32_t> vertices = set.vertices();
    shape.vertex_count = static_cast<std::uint32_t>(vertices.size());
    std::copy(vertices.begin(), vertices.end(), shape.vertices);
    return true;
}

void fill_leaf(const LeafShape& shape, std::span<const std::uint32_t> prim_ids,
               std::span<const vec3> positions, Leaf& leaf, std::uint32_t* leaf_vertices) {
    const auto count = static_cast<std::uint32_t>(prim_ids.size());
    for (std::uint32_t i = 0; i < kLeafTriangles; ++i) {
        const bool used = i < count;
        leaf.prim_id[i] = used ? prim_ids[i] : kNoPrim;
        leaf.vertex[i].corners = used ? shape.corners[i] : pack_corners(0, 0, 0, count);
    }
    for (std::uint32_t slot = 0; slot < kLeafVertices; ++slot) {
        const std::uint32_t vertex = shape.vertices[slot < shape.vertex_count ? slot : 0];
        leaf_vertices[slot] = vertex;
        leaf.vertex[slot].x = positions[vertex].x;
        leaf.vertex[slot].y = positions[vertex].y;
        leaf.vertex[slot].z = positions[vertex].z;
    }
}

}  // namespace mray
