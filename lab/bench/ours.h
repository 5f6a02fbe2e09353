// The tracers of morphray that are measured, and the rays that they trace.
#pragma once

#include <vector>

#include "common/base/aligned_vector.h"
#include "common/bvh/bvh.h"
#include "common/simd/simd_target.h"
#include "lab/bench/bench_scene.h"
#include "lab/bench/trace_work.h"

namespace mray::bench {

/// Those that can trace the work: "packet"; "stream", the rays of a tile by one call of the
/// single-ray tracer; "single", a call for each ray. The tree must outlive them.
std::vector<Tracer> our_tracers(const Bvh& bvh, const SimdTarget& target, const TraceWork& work);

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
