// The works, each of which compares all methods of morphray with every peer.
#pragma once

#include <span>

#include "common/base/thread_arena.h"
#include "lab/bench/bench_scene.h"
#include "lab/bench/embree/embree_peer.h"
#include "lab/bench/report.h"
#include "lab/bench/trace_work.h"

namespace mray::bench {

/// The same number of threads for both sides.
struct Rig {
    /// One for each instruction set of Embree.
    std::span<const EmbreeDevice> devices;
    int threads;
    int repeat;
    Report& report;
};

/// As timed(), in an arena.
template <class Work>
double timed_in(ThreadArena& arena, const Work& work) {
    return timed([&] { arena.execute(work); });
}

/// Traces a work with every suitable tracer, against each group of Embree's ways. The peer is the
/// fastest of its group over Embree's trees and instruction sets: first a trial of all, then rounds
/// of the fastest of each group and ours in turn.
void bench_trace(const Rig& rig, const BenchScene& scene, const EmbreeScenes& embree,
                 const TraceWork& work);

/// Refits back and forth between two frames, against Embree's refit and a copy of the tree's bytes.
/// `primary` checks the trees: its rays are traced through both.
void bench_refit(const Rig& rig, const BenchScene& scene, const TraceWork& primary);

/// Builds trees, against Embree's Morton, binned and spatial-split builds; `primary` as above.
void bench_build(const Rig& rig, const BenchScene& scene, const TraceWork& primary);

/// Plays every second frame of the animation, 12 at most: for each the tree follows the positions,
/// by the policy Auto, and an image with shadows is traced and shaded; against Embree's 16-wide
/// packets over its trees that are refitted or built again, and the 2007 method, refitted. Does
/// nothing for an animation of one frame.
void bench_frame(const Rig& rig, const BenchScene& scene, const TraceWork& primary);

/// Queries all triangles by the public interface, as many times as an image has pixels: closest
/// points, against Embree's point queries and, if the build has it, CGAL's AABB_tree; the number of
/// hits of camera rays and random rays, and which points are inside, against Embree's single rays
/// whose filter counts and rejects each hit. Every peer is the fastest over Embree's instruction
/// sets, robust and fast scenes apart.
void bench_queries(const Rig& rig, const BenchScene& scene);

}  // namespace mray::bench
