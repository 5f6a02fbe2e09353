// The paper's tracer on a whole work.
#pragma once

#include <vector>

#include "lab/bench/paper_2007/sweep_tree.h"
#include "lab/bench/trace_work.h"

namespace mray::bench::paper_2007 {

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
