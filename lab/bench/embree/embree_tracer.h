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

    /// Restores records that a trace has overwritten; needed before each trace of a part. Runs in
    /// the calling thread's arena, like trace().
    virtual void reset() = 0;
    /// Finds t, u, v and primID of closest hits, or what is occluded.
    virtual void trace(const EmbreeScene& scene, const WorkPart& part) = 0;
    /// The answers of the last trace of each part.
    virtual TraceAnswers answers() const = 0;
};

/// Where Embree's ray records come from.
enum class RecordSource {
    /// Each is made within the time where it stays in the cache, from what our tracers read too:
    /// the camera, blocks of shadow rays, or rays of 32 bytes. Answers are stored, as ours are.
    kMade,
    /// All have been made before, and are streamed from memory. Answers stay in them.
    kMemory,
};

struct EmbreeWay {
    /// "Intersect16"
    std::string name;
    RecordSource source;
    /// One ray a call.
    bool one_ray;
    std::unique_ptr<EmbreeTracer> (*make)(const TraceWork&);
};

/// All ways to trace such a work. Primary and shadow rays, all with the flag for coherent rays:
/// packets of 16, and single rays. Diffuse rays and ambient occlusion, with the flag for incoherent
/// ones: single rays, packets of 4, 8 and 16, and streams if Embree has them; of diffuse rays none
/// from memory. A work of single rays: those.
std::vector<EmbreeWay> embree_ways(WorkKind kind);

/// The way of one ray a call with records in memory.
std::unique_ptr<EmbreeTracer> single_rays_from_memory(const TraceWork& work);

}  // namespace mray::bench
