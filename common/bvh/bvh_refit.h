// The two steps of a refit, each on one element; who calls them in which threads is another matter.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "common/bvh/box.h"
#include "common/bvh/bvh.h"
#include "common/simd/float4.h"

namespace morphray {

/// What a refit reads and writes of a tree. A loop keeps a copy of it in registers; through the
/// tree itself refits take 1.3 to 1.5 times as long.
struct RefitArrays {
    explicit RefitArrays(Bvh& bvh)
        : nodes(bvh.nodes.data()),
          leaves(bvh.leaves.data()),
          leaf_vertices(bvh.leaf_vertices.data()),
          leaf_parents(bvh.leaf_parents.data()),
          node_parents(bvh.node_parents.data()) {}

    Node* nodes;
    Leaf* leaves;
    const std::uint32_t* leaf_vertices;
    const std::uint32_t* leaf_parents;
    const std::uint32_t* node_parents;
};

/// Copies the positions of a leaf's vertices into it and gives its parent's slot their bounds.
/// Vertices that are not finite are copied, but bound nothing.
inline void refit_leaf(const RefitArrays& tree, std::uint32_t leaf_index,
                       std::span<const vec3> positions) {
    Leaf& leaf = tree.leaves[leaf_index];
    const std::uint32_t* source = &tree.leaf_vertices[std::size_t{leaf_index} * kLeafVertices];
    const std::uint32_t last = static_cast<std::uint32_t>(positions.size()) - 1;
    Box4 bounds = Box4::none();
    for (std::uint32_t slot = 0; slot < kLeafVertices; ++slot) {
        const std::uint32_t vertex = source[slot];
        // A whole register holds the next vertex's x, too, but for the last.
        const float4 p = vertex == last ? load3(positions[last]) : load4(&positions[vertex].x);
        bounds.extend(p);
        float* const to = &leaf.vertex[slot].x;
        store4(to, replace_xyz(load4(to), p));
    }
    Box box = bounds.box();
    if (!is_finite_vertex(box.upper)) [[unlikely]] {
        box = {};
        for (const LeafVertex& v : leaf.vertex) {
            if (is_finite_vertex({v.x, v.y, v.z})) box.extend(vec3(v.x, v.y, v.z));
        }
    }
    const std::uint32_t parent = tree.leaf_parents[leaf_index];
    set_slot_box(tree.nodes[parent / kWidth], parent % kWidth, box);
}

/// Gives the parent's slot of a node, whose own slots are up to date, their union.
inline void refit_node(const RefitArrays& tree, std::uint32_t node_index) {
    const std::uint32_t parent = tree.node_parents[node_index];
    if (parent == kNoParent) return;
    const Node& node = tree.nodes[node_index];
    float4 lower[3] = {load4(node.lower_x), load4(node.lower_y), load4(node.lower_z)};
    float4 upper[3] = {load4(node.upper_x), load4(node.upper_y), load4(node.upper_z)};
    for (std::uint32_t slot = 4; slot < kWidth; slot += 4) {
        lower[0] = min(lower[0], load4(node.lower_x + slot));
        lower[1] = min(lower[1], load4(node.lower_y + slot));
        lower[2] = min(lower[2], load4(node.lower_z + slot));
        upper[0] = max(upper[0], load4(node.upper_x + slot));
        upper[1] = max(upper[1], load4(node.upper_y + slot));
        upper[2] = max(upper[2], load4(node.upper_z + slot));
    }
    const auto least = [](float4 v) { return lesser(lesser(v[0], v[1]), lesser(v[2], v[3])); };
    const auto most = [](float4 v) { return greater(greater(v[0], v[1]), greater(v[2], v[3])); };
    set_slot_box(tree.nodes[parent / kWidth], parent % kWidth,
                 {{least(lower[0]), least(lower[1]), least(lower[2])},
                  {most(upper[0]), most(upper[1]), most(upper[2])}});
}

}  // namespace morphray
