// The tracers of morphray that are measured.
#pragma once

#include <functional>
#include <span>
#include <string>
#include <vector>

#include "common/base/aligned_vector.h"
#include "common/bvh/bvh.h"
#include "common/simd/simd_target.h"
#include "lab/bench/trace_work.h"

namespace mray::bench {

/// How a tracer takes its rays.
enum class RaysAtOnce {
    /// A tile's, which have an origin in common.
    kPacket,
    /// A tile's, whatever they are.
    kStream,
    /// One a call.
    kOne,
};

struct OurTracer {
    std::string name;
    /// The instruction set.
    std::string target;
    RaysAtOnce at_once;
    /// The works that it can trace.
    std::vector<WorkKind> works;
    /// Traces a part of a work in the calling thread's arena. This is timed.
    std::function<void(const TraceWork&, const WorkPart&, TraceAnswers&)> trace_part;
    /// `trace_part` writes primary hits row by row as in an image, not ray by ray.
    bool in_image_order = false;

    void trace(const TraceWork& work, TraceAnswers& answers) const {
        trace_part(work, work.whole(), answers);
    }
};

/// The tracers for each target, best first; with the scalar target also the reference. Needs at
/// least one target. The tree must outlive them.
std::vector<OurTracer> our_tracers(const Bvh& bvh, std::span<const SimdTarget> targets);

/// "stream": the rays of a tile by one call of the single-ray tracer.
OurTracer ray_streams(const Bvh& bvh, const SimdTarget& target);
/// "single": a call of the single-ray tracer for each ray.
OurTracer single_rays(const Bvh& bvh, const SimdTarget& target);

/// The closest hits of a work by the scalar reference, in the calling thread's arena.
AlignedVector<Hit> reference_hits(const Bvh& bvh, const TraceWork& work);

}  // namespace mray::bench
