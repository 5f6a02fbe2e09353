// Embree tracing a work by single rays, packets or streams.
#pragma once

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "lab/bench/embree/embree_scene.h"
#include "lab/bench/trace_work.h"

namespace mray::bench {

/// One of Embree's ways to trace a work. The work and the scene outlive it.
class EmbreeTracer {
public:
    virtual ~EmbreeTracer() = default;

    /// Finds t, u, v and primID of closest hits, or what is occluded, in the calling thread's
    /// arena.
    virtual void trace(const EmbreeScene& scene, const WorkPart& part) = 0;
    /// The answers of the last trace of each part.
    virtual TraceAnswers answers() const = 0;
};

struct EmbreeWay {
    /// "Intersect16"
    std::string name;
    /// One ray a call.
    bool one_ray;
    std::unique_ptr<EmbreeTracer> (*make)(const TraceWork&);
};

/// All ways to trace such a work. Primary and shadow rays, all with the flag for coherent rays:
/// packets of 16, and single rays. Diffuse rays and ambient occlusion, with the flag for incoherent
/// ones: single rays, packets of 4, 8 and 16, and streams if Embree has them. A work of single
/// rays: those. Each record is made within the time where it stays in the cache, from what our
/// tracers read too: the camera, blocks of shadow rays, or rays of 32 bytes. Answers are stored, as
/// ours are.
std::vector<EmbreeWay> embree_ways(WorkKind kind);

}  // namespace mray::bench
