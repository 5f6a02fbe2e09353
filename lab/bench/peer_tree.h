// The binary tree of the peers that have no builder of their own.
#pragma once

#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "common/bvh/builder/bvh_builder.h"
#include "common/scene/mesh.h"
#include "lab/bench/trace_work.h"

namespace mray::bench {

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

/// The cost of a node in tests of a triangle, and how many triangles a leaf has at most.
struct PeerTreeConfig {
    double node_cost;
    std::uint32_t most_triangles;
};

/// Positions in scene space. Triangles with vertices that are not finite are left out. At most
/// kMaxBinaryHeight levels (common/bvh/builder/binary_tree.h) are below the root.
PeerTree build_peer_tree(const Topology& topology, std::span<const vec3> positions,
                         const PeerTreeConfig& config);

/// The tree of the method of 2007: binned SAH, a box test at the cost of a triangle's.
inline PeerTree build_paper_tree(const Topology& topology, std::span<const vec3> positions) {
    return build_peer_tree(topology, positions, {2, std::numeric_limits<std::uint32_t>::max()});
}

/// The method of 2007, for primary or shadow rays, with packets made before, as Embree's are.
Tracer paper_tracer(const PeerTree& tree, const TraceWork& work);

/// Fits leaves in the calling thread's arena, then inner nodes one by one. Finite positions.
void refit(PeerTree& tree, const Topology& topology, std::span<const vec3> positions);

}  // namespace mray::bench
