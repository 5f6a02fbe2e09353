// The works: each measures everything of ours against every peer.
#pragma once

#include <functional>
#include <vector>

#include "bench/bench_scene.h"
#include "bench/embree_scene.h"
#include "bench/row.h"
#include "bench/trace_work.h"
#include "cpu/simd_target.h"

namespace morphray::bench {

/// One device and the same number of threads for both sides.
struct Rig {
    const EmbreeDevice& device;
    int threads;
    int repeat;
    /// Those that our tracers are measured with.
    std::vector<cpu::SimdTarget> targets;
    /// Receives the rows as they are done.
    std::function<void(const Row&)> report;
};

/// Traces a work with every tracer of ours that can, against each group of Embree's ways. The peer
/// is the best way of its group over the best of Embree's trees.
void bench_trace(const Rig& rig, const BenchScene& scene, const TraceWork& work);

/// Refits back and forth between two frames, against Embree's refit and a copy of the tree's bytes.
/// `primary` checks the trees: mismatches count its rays, traced through both.
void bench_refit(const Rig& rig, const BenchScene& scene, const TraceWork& primary);

/// Builds from nothing, against Embree's Morton, binned and spatial-split builds; `primary` as
/// above.
void bench_build(const Rig& rig, const BenchScene& scene, const TraceWork& primary);

}  // namespace morphray::bench
