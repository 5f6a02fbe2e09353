// Based on: I. Wald, S. Boulos, P. Shirley. Ray tracing deformable scenes using dynamic bounding
// volume hierarchies. ACM Transactions on Graphics 26(1). 2007.
//
// A binary tree by full sweeps. Changed: triangles are sorted once for each axis and then divided
// stably, which gives the order of a sort for each node.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/bvh/box.h"
#include "common/scene/mesh.h"

namespace mray::bench::paper_2007 {

/// 32 B. Inner nodes: the children are nodes `first` (the lower one on `axis`) and first + 1.
/// Leaves, which have count > 0: triangles first to first + count.
struct Node {
    vec3 lower;
    std::uint32_t first;
    vec3 upper;
    std::uint32_t count : 30;
    std::uint32_t axis : 2;
};

struct Triangle {
    vec3 a, b, c;
    std::uint32_t prim_id;
};

/// nodes[0] is the root; empty without a finite triangle. Triangles are in the order of the leaves.
struct Tree {
    std::vector<Node> nodes;
    std::vector<Triangle> triangles;
};

/// Levels below the root that a tree has at most; deeper, everything is one leaf.
inline constexpr int kMaxDepth = 96;

/// Positions in scene space. Triangles with vertices that are not finite are left out.
Tree build_sweep_tree(const Topology& topology, std::span<const vec3> positions);

/// Moves the triangles of a tree and fits its boxes (section 4), the leaves in the calling thread's
/// arena and then the inner nodes one after the other. Finite positions of the tree's topology.
void refit(Tree& tree, const Topology& topology, std::span<const vec3> positions);

}  // namespace mray::bench::paper_2007
