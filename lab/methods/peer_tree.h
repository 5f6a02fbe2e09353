// The binary tree of the peers that have no builder of their own.
#pragma once

#include "common/scene/mesh.h"

namespace mray::lab {

/// Inner nodes: children `first` (lower on `axis`) and first + 1. Leaves (count > 0): triangles.
struct PeerNode {
    vec3 lower;
    std::uint32_t first;
    vec3 upper;
    std::uint32_t count : 30;
    std::uint32_t axis : 2;
};

struct PeerTriangle {
    vec3 a, b, c;
    std::uint32_t prim_id;
};

/// nodes[0] is the root; empty without a finite triangle. Triangles are in the order of the leaves.
struct PeerTree {
    std::vector<PeerNode> nodes;
    std::vector<PeerTriangle> triangles;
};

/// Binned SAH. Positions in scene space. Triangles with vertices that are not finite are left out.
/// At most kMaxBinaryHeight levels (common/bvh/builder/binary_tree.h) are below the root.
/// `node_cost` is that of a node in tests of a triangle, 2 for that of its children's boxes; leaves
/// have at most so many triangles.
PeerTree build_peer_tree(const Topology& topology, std::span<const vec3> positions,
                         double node_cost = 2,
                         std::uint32_t most_triangles = std::numeric_limits<std::uint32_t>::max());

/// Fits leaves in the calling thread's arena, then inner nodes one by one. Finite positions.
void refit(PeerTree& tree, const Topology& topology, std::span<const vec3> positions);

}  // namespace mray::lab
