// Based on: I. Wald, S. Boulos, P. Shirley. Ray tracing deformable scenes using dynamic bounding
// volume hierarchies. ACM Transactions on Graphics 26(1). 2007.
//
// A binary tree by full sweeps, and the paper's traversal as it stands there, with vectors of 16
// where it had 4. Changed: triangles are intersected by the planes through the common origin and
// their edges, set up once a packet. Its rounding is its own, so hits differ from ours as rarely as
// Embree's.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/bvh/box.h"
#include "common/scene/mesh.h"
#include "lab/bench/trace_work.h"

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

struct PacketRays;
struct PacketAnswers;

/// Keeps its packets made, as Embree's are; the tree and the work outlive it.
class WorkTracer {
public:
    /// work: of primary or shadow rays.
    WorkTracer(const Tree& tree, const TraceWork& work);
    ~WorkTracer();

    /// In the calling thread's arena.
    void trace(const WorkPart& part);
    void trace() { trace(work_->whole()); }
    /// Those of the last trace.
    TraceAnswers answers() const;

private:
    /// The packets of a tile.
    struct Range {
        std::size_t begin, end;
    };

    const Tree* tree_;
    const TraceWork* work_;
    std::vector<PacketRays> packets_;
    std::vector<PacketAnswers> answers_;
    std::vector<Range> ranges_;
};

}  // namespace mray::bench::paper_2007
