// The binary tree of the method of 2007.
#pragma once

#include <cstdint>
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

/// Builds by binned SAH, where a test of a box costs as much as one of a triangle, without
/// triangles that are not finite. At most kMaxBinaryHeight levels are below the root.
PeerTree build_paper_tree(const Topology& topology, std::span<const vec3> positions);

/// The method of 2007, a group of its own, for primary or shadow rays. Keeps its packets made, as
/// Embree's are; tree and work outlive it.
Tracer paper_tracer(const PeerTree& tree, const TraceWork& work);

/// Fits leaves in the calling thread's arena, then inner nodes one by one. Finite positions.
void refit(PeerTree& tree, const Topology& topology, std::span<const vec3> positions);

}  // namespace mray::bench
