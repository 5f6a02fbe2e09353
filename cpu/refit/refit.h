// Refitting a tree of constant topology to moved vertices on the CPU.
#pragma once

#include <cstdint>
#include <span>

#include "common/simd/simd_target.h"
#include "common/update/refit_plan.h"

namespace mray::cpu {

/// Gives every leaf its new vertex positions (scene space) and every slot its new box, leaves
/// first, then level by level up (I. Wald, S. Boulos, P. Shirley. Ray Tracing Deformable Scenes
/// Using Dynamic Bounding Volume Hierarchies. ACM TOG 26(1), 2007, section 4). The bytes are the
/// same for any number of threads and any target, and equal to those of a build if the positions
/// are. Runs in the calling thread's arena. parts: only these, where the others have these
/// positions.
void refit(Bvh& bvh, std::span<const vec3> positions, const SimdTarget& target = best_simd_target(),
           const MovedParts* parts = nullptr);

// ---- A refit of one element without SIMD: for leaves that the kernels leave out, for targets
// without SIMD, and as the reference of tests.

/// The arrays of a tree, of which a loop keeps a copy in registers (lab/notes/build_and_refit.md).
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

/// The numbers first .. first + count - 1, or what a list has at these places.
struct IndexSequence {
    const std::uint32_t* list;
    std::uint32_t first, count;

    std::uint32_t operator[](std::uint32_t i) const {
        return list == nullptr ? first + i : list[first + i];
    }
};

/// Copies the positions of a leaf's vertices into it and gives its parent's slot their bounds,
/// padded. Vertices that are not finite are copied, but bound nothing.
inline void refit_leaf(const RefitArrays& tree, std::uint32_t leaf_index,
                       std::span<const vec3> positions) {
    Leaf& leaf = tree.leaves[leaf_index];
    Box box;
    LeafVertex* to = leaf.vertex;
    for (const std::uint32_t vertex : vertices_of(tree.leaf_vertices, leaf_index)) {
        const vec3 p = positions[vertex];
        to->x = p.x;
        to->y = p.y;
        to->z = p.z;
        ++to;
        if (is_finite_vertex(p)) box.extend(p);
    }
    set_parent_box(tree.nodes, tree.leaf_parents[leaf_index], padded(box));
}

/// Gives the parent's slot of a node, whose own slots are up to date, their union.
inline void refit_node(const RefitArrays& tree, std::uint32_t node_index) {
    const std::uint32_t parent = tree.node_parents[node_index];
    if (parent == kNoParent) return;
    set_parent_box(tree.nodes, parent, node_box(tree.nodes[node_index]));
}

}  // namespace mray::cpu
