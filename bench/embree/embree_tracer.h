// Embree tracing a work by single rays, packets or streams.
#pragma once

#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "bench/embree/embree_scene.h"
#include "bench/works/trace_work.h"

namespace mray::bench {

/// One of Embree's ways to trace a work, with the rays in its own records. The work and the scene
/// outlive it.
class EmbreeTracer {
public:
    virtual ~EmbreeTracer() = default;

    /// Restores the records that a trace has overwritten; needed before each trace. Runs in the
    /// calling thread's arena, like trace().
    virtual void reset() = 0;
    /// Fills the records: tfar, and for closest hits u, v, primID, geomID and the normal.
    virtual void trace(const EmbreeScene& scene) = 0;
    /// The answers of the last trace.
    virtual TraceAnswers answers() const = 0;
};

/// The fastest way of each group is the peer.
struct EmbreeWay {
    /// "Intersect16 coherent"
    std::string name;
    int group;
    std::function<std::unique_ptr<EmbreeTracer>(const TraceWork&)> make;
};

/// Primary and shadow rays: packets of 16, and single rays. Ambient occlusion, in one group: single
/// rays, packets of 4, 8 and 16, and streams, all with the flag for incoherent rays.
std::vector<EmbreeWay> embree_ways(std::uint32_t rays);

}  // namespace mray::bench
