// The binary tree of the method of 2007.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/bvh/builder/bvh_builder.h"
#include "common/scene/mesh.h"
#include "lab/bench/trace_work.h"

namespace mray::bench {

/// 32 B. Inner nodes: the children are nodes `first` (the lower one on `axis`) and first + 1.
/// Leaves, which have count > 0: triangles first to first + count.
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

/// Builds by binned SAH, where a test of a box costs as much as one of a triangle. Positions are in
/// scene space. Triangles with vertices that are not finite are left out. At most kMaxBinaryHeight
/// levels (common/bvh/builder/binary_tree.h) are below the root.
PeerTree build_paper_tree(const Topology& topology, std::span<const vec3> positions);

/// The method of 2007 (paper_2007/packet_tracer.cpp), "paper-2007" in a group of its own, for
/// primary or shadow rays. Keeps its packets made, as Embree's are; the tree and the work outlive
/// it.
Tracer paper_tracer(const PeerTree& tree, const TraceWork& work);

/// Moves the triangles of a tree and fits its boxes, the leaves in the calling thread's arena and
/// then the inner nodes one after the other. Finite positions of the tree's topology.
void refit(PeerTree& tree, const Topology& topology, std::span<const vec3> positions);

}  // namespace mray::bench
