// The tracers of morphray that are measured, and the rays that they trace.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "common/base/aligned_vector.h"
#include "common/bvh/bvh.h"
#include "common/simd/simd_target.h"
#include "lab/bench/bench_scene.h"
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

/// "packet"; "stream", the rays of a tile by one call of the single-ray tracer; "single", a call
/// for each ray. The tree must outlive them.
std::vector<OurTracer> our_tracers(const Bvh& bvh, const SimdTarget& target);

/// The closest hits of a work by the scalar reference, in the calling thread's arena.
AlignedVector<Hit> reference_hits(const Bvh& bvh, const TraceWork& work);

/// Rays of ambient occlusion of a pixel. As many rays in all as an image has pixels: fewer pixels
/// have any, so that each work takes about as long.
inline constexpr std::uint32_t kAoSamples = 4;

/// Makes the rays of all works of a scene, which outlives it.
class SceneRays {
public:
    explicit SceneRays(const BenchScene& scene);

    const TraceWork& primary() const { return primary_; }
    TraceWork work(WorkKind kind) const;

private:
    const BenchScene& scene_;
    TraceWork primary_;
    AlignedVector<Hit> hits_;
};

}  // namespace mray::bench
