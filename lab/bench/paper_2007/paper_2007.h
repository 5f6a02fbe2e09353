// Based on: I. Wald, S. Boulos, P. Shirley. Ray tracing deformable scenes using dynamic bounding
// volume hierarchies. ACM Transactions on Graphics 26(1). 2007.
//
// A binary tree by binned SAH, and the paper's traversal as it stands there, with vectors of 16
// where it had 4. Changed: triangles are intersected by the planes through the common origin and
// their edges, set up once a packet. Its rounding is its own, so hits differ from ours as rarely as
// Embree's.
#pragma once

#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "lab/bench/peer_tree.h"
#include "lab/bench/trace_work.h"

namespace mray::bench::paper_2007 {

/// A test of a box costs as much as one of a triangle.
inline PeerTree build_tree(const Topology& topology, std::span<const vec3> positions) {
    return build_peer_tree(topology, positions, {2, std::numeric_limits<std::uint32_t>::max()});
}

struct PacketRays;
struct PacketAnswers;

/// Keeps its packets made, as Embree's are; the tree and the work outlive it.
class WorkTracer {
public:
    /// work: of primary or shadow rays.
    WorkTracer(const PeerTree& tree, const TraceWork& work);
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

    const PeerTree* tree_;
    const TraceWork* work_;
    std::vector<PacketRays> packets_;
    std::vector<PacketAnswers> answers_;
    std::vector<Range> ranges_;
};

}  // namespace mray::bench::paper_2007
