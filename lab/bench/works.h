// The works, each of which compares all methods of morphray with every peer.
#pragma once

#include <span>

#include "common/base/thread_arena.h"
#include "lab/bench/bench_scene.h"
#include "lab/methods/embree.h"
#include "lab/methods/report.h"
#include "lab/methods/tracers.h"

namespace mray::lab {

/// The same number of threads for both sides.
struct Rig {
    /// One for each instruction set of Embree.
    std::span<const EmbreeDevice> devices;
    ThreadArena& arena;
    int repeat;
    Report& report;
};

/// By every suitable tracer, against each group of Embree's ways: the fastest of a trial.
void bench_trace(const Rig& rig, const BenchScene& scene, std::span<const EmbreeVariant> embree,
                 const RaySet& set);

/// Against Embree's refit and a copy of the tree's bytes. `primary` is traced through both trees.
void bench_refit(const Rig& rig, const BenchScene& scene, const RaySet& primary);

/// Builds trees, against Embree's Morton, binned and spatial-split builds; `primary` as above.
void bench_build(const Rig& rig, const BenchScene& scene, const RaySet& primary);

/// Plays every second frame, 12 at most, and traces and shades an image with shadows: by the policy
/// Auto, by Embree's 16-wide packets, refitted or built again, and by the 2007 method, refitted.
void bench_frame(const Rig& rig, const BenchScene& scene, const RaySet& primary);

/// Asks by the public interface for closest points, against Embree's point queries and CGAL's
/// AABB_tree, and for counts of hits and insides, against Embree's single rays with a filter.
void bench_queries(const Rig& rig, const BenchScene& scene);

}  // namespace mray::lab
