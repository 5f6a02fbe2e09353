// The tracers, refits and builders of morphray that are measured. New ones are added here only.
#pragma once

#include <functional>
#include <span>
#include <string>
#include <vector>

#include "bench/works/trace_work.h"
#include "common/bvh/bvh.h"
#include "common/scene/mesh.h"
#include "common/simd/simd_target.h"

namespace mray::bench {

struct OurTracer {
    std::string name;
    /// The instruction set.
    std::string target;
    /// The works that it can trace, as kRays values.
    std::vector<std::uint32_t> works;
    /// Traces a whole work in the calling thread's arena. This is timed.
    std::function<void(const TraceWork&, TraceAnswers&)> trace;
    /// `trace` writes primary hits row by row as in an image, not ray by ray.
    bool in_image_order = false;
};

/// The tracers for each target, best first; with the scalar target also the reference. Needs at
/// least one target. The tree must outlive them.
std::vector<OurTracer> our_tracers(const Bvh& bvh, std::span<const SimdTarget> targets);

/// "single": every ray on its own.
OurTracer single_rays(const Bvh& bvh, const SimdTarget& target);

/// The closest hits of a primary work by the scalar reference, in the calling thread's arena.
std::vector<Hit> reference_hits(const Bvh& bvh, const TraceWork& work);

struct OurRefit {
    std::string name;
    std::string target;
    /// In the calling thread's arena.
    std::function<void(Bvh&, std::span<const vec3> positions)> refit;
};

std::vector<OurRefit> our_refits();

struct OurBuild {
    std::string name;
    std::string target;
    std::function<Bvh(const Topology&, std::span<const vec3> positions, int threads)> build;
};

std::vector<OurBuild> our_builds();

}  // namespace mray::bench
