#include "lab/bench/embree/embree_tracer.h"
#include "lab/bench/embree/record_ways.h"
#include "lab/embree.h"

namespace mray::bench {
namespace {

template <int N>
void add(std::vector<EmbreeWay>& ways, const char* name, bool in_memory = true) {
    ways.push_back({name, RecordSource::kMade, false, trace_made<N>});
    if (in_memory) ways.push_back({name, RecordSource::kMemory, false, trace_from_memory<N>});
}

}  // namespace

std::vector<EmbreeWay> embree_ways(WorkKind kind) {
    const bool any = kind == WorkKind::kShadow || kind == WorkKind::kAo;
    std::vector<EmbreeWay> ways = {
        {any ? "Occluded1" : "Intersect1", RecordSource::kMade, true, trace_made<1>}};
    if (kind == WorkKind::kOneRay) return ways;
    const bool in_memory = kind != WorkKind::kDiffuse;
    add<16>(ways, any ? "Occluded16" : "Intersect16", in_memory);
    if (kind == WorkKind::kPrimary || kind == WorkKind::kShadow) return ways;
    add<1>(ways, any ? "Occluded1" : "Intersect1", in_memory);
    add<4>(ways, any ? "Occluded4" : "Intersect4", in_memory);
    add<8>(ways, any ? "Occluded8" : "Intersect8", in_memory);
    if (embree::kHasStreams) add<kStream>(ways, any ? "Occluded1M" : "Intersect1M", in_memory);
    return ways;
}

std::unique_ptr<EmbreeTracer> single_rays_from_memory(const TraceWork& work) {
    return trace_from_memory<1>(work);
}

}  // namespace mray::bench
