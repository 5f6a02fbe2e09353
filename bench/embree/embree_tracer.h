// Embree tracing a work, through single rays, packets or streams.
#pragma once

#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "bench/embree/embree_scene.h"
#include "bench/works/trace_work.h"

namespace morphray::bench {

/// One of Embree's ways to trace a work, with the rays in its own records. What it is given
/// outlives it.
class EmbreeTracer {
public:
    virtual ~EmbreeTracer() = default;

    /// Undoes what a trace wrote into the records, as each trace needs. In the calling thread's
    /// arena, as `trace`.
    virtual void reset() = 0;
    /// Fills the records: tfar, and for closest hits u, v, primID, geomID and the normal.
    virtual void trace(const EmbreeScene& scene) = 0;
    /// The answers of the last trace.
    virtual TraceAnswers answers() const = 0;
};

/// Ways of the same group compete for being the peer: the best of them is the one to beat.
struct EmbreeWay {
    /// "Intersect16 coherent"
    std::string name;
    int group;
    std::function<std::unique_ptr<EmbreeTracer>(const TraceWork&)> make;
};

/// Primary rays: packets of 16, and single rays. Shadow rays: likewise. Ambient occlusion, one
/// group: single rays, packets of 4, 8 and 16, and streams, all with the flag for incoherent rays.
std::vector<EmbreeWay> embree_ways(std::uint32_t rays);

}  // namespace morphray::bench
