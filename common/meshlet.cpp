#include "common/meshlet.h"

#include "common/vertex_set.h"

namespace morphray {

void fill_leaf(const Topology& topology, std::span<const vec3> positions,
               std::span<const std::uint32_t> prim_ids, Leaf& leaf, std::uint32_t* leaf_vertices) {
    const auto count = static_cast<std::uint32_t>(prim_ids.size());
    VertexSet set;
    for (std::uint32_t i = 0; i < count; ++i) {
        leaf.prim_id[i] = prim_ids[i];
        const uvec3 t = topology.triangles[prim_ids[i]];
        const std::uint32_t a = set.add(t.x);
        const std::uint32_t b = set.add(t.y);
        const std::uint32_t c = set.add(t.z);
        leaf.vertex[i].corners = pack_corners(a, b, c, count);
    }
    for (std::uint32_t i = count; i < kLeafTriangles; ++i) {
        leaf.prim_id[i] = kNoPrim;
        leaf.vertex[i].corners = pack_corners(0, 0, 0, count);
    }
    const std::span<const std::uint32_t> vertices = set.vertices();
    for (std::uint32_t slot = 0; slot < kLeafVertices; ++slot) {
        const std::uint32_t vertex = vertices[slot < vertices.size() ? slot : 0];
        leaf_vertices[slot] = vertex;
        leaf.vertex[slot].x = positions[vertex].x;
        leaf.vertex[slot].y = positions[vertex].y;
        leaf.vertex[slot].z = positions[vertex].z;
    }
}

}  // namespace morphray
