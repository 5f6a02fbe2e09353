#include "lab/bench/paper_2007/work_tracer.h"

#include "lab/bench/paper_2007/packet_tracer.h"

namespace mray::bench::paper_2007 {

WorkTracer::WorkTracer(const Tree& tree, const TraceWork& work) : tree_(&tree), work_(&work) {
    for (const TileRays& tile : work.tiles) {
        const std::size_t begin = packets_.size();
        for (const PacketRays& packet : make_packets(work, tile)) packets_.push_back(packet);
        ranges_.push_back({begin, packets_.size()});
    }
    answers_.resize(packets_.size());
}

WorkTracer::~WorkTracer() = default;

void WorkTracer::trace(const WorkPart& part) {
    tbb::parallel_for(part.first_tile, part.end_tile, [&](std::size_t tile) {
        for (std::size_t i = ranges_[tile].begin; i < ranges_[tile].end; ++i) {
            const auto trace_packet = work_->any_hit() ? trace_any : trace_closest;
            trace_packet(*tree_, packets_[i], answers_[i]);
        }
    });
}

TraceAnswers WorkTracer::answers() const {
    TraceAnswers answers(*work_);
    for (Hit& hit : answers.hits) hit = no_hit();
    for (std::size_t i = 0; i < packets_.size(); ++i) {
        for (int g = 0; g < kGroups; ++g) {
            for (int lane = 0; lane < kLanes; ++lane) {
                const std::size_t ray = packets_[i].first_ray[g] + lane;
                const PacketAnswers& a = answers_[i];
                if (work_->any_hit()) {
                    answers.occluded[ray] = a.t[g][lane] < 0;
                } else if (a.prim_id[g][lane] >= 0) {
                    answers.hits[ray] = {a.t[g][lane], a.u[g][lane], a.v[g][lane],
                                         static_cast<std::uint32_t>(a.prim_id[g][lane])};
                }
            }
        }
    }
    return answers;
}

}  // namespace mray::bench::paper_2007
