// The works, each of which compares all methods of morphray with every peer.
#pragma once

#include <functional>
#include <span>
#include <vector>

#include "common/simd/simd_target.h"
#include "lab/bench/bench_scene.h"
#include "lab/bench/embree/embree_peer.h"
#include "lab/bench/ours.h"
#include "lab/bench/report.h"
#include "lab/bench/trace_work.h"

namespace mray::bench {

/// The same number of threads for both sides.
struct Rig {
    /// One for each instruction set of Embree.
    std::span<const EmbreeDevice> devices;
    int threads;
    int repeat;
    /// The instruction sets of morphray's tracers.
    std::vector<SimdTarget> targets;
    /// Receives each row when it is done.
    std::function<void(const Row&)> report;
};

/// A row with the fields that all rows of a work have in common.
inline Row row_of(const Rig& rig, const BenchScene& scene, const std::string& work) {
    Row row;
    row.scene = scene.name;
    row.triangles = scene.topology().triangles.size();
    row.view = name_of(scene.view_kind);
    row.work = work;
    row.threads = rig.threads;
    return row;
}

/// Traces a work with every suitable tracer, against each group of Embree's ways. The peer is the
/// fastest of its group over Embree's trees and instruction sets: first a trial of all, then rounds
/// of the fastest of each group and ours in turn.
void bench_trace(const Rig& rig, const BenchScene& scene, const EmbreeScenes& embree,
                 const TraceWork& work);

/// Refits back and forth between two frames, against Embree's refit and a copy of the tree's bytes.
/// `primary` checks the trees: mismatches count its rays that differ between both trees.
void bench_refit(const Rig& rig, const BenchScene& scene, const TraceWork& primary);

/// Builds trees, against Embree's Morton, binned and spatial-split builds; `primary` as above.
void bench_build(const Rig& rig, const BenchScene& scene, const TraceWork& primary);

/// Plays every second frame of the clip, 12 at most: for each the tree follows the positions, by
/// the policy Auto, and an image with shadows is traced and shaded; against Embree's 16-wide
/// packets over its trees that are refitted or built again, and the 2007 method, refitted. Does
/// nothing for a clip of one frame.
void bench_frame(const Rig& rig, const BenchScene& scene, const TraceWork& primary);

/// Queries all triangles by the public interface, as many times as an image has pixels: closest
/// points, against Embree's point queries and, if the build has it, CGAL's AABB_tree; the number of
/// hits of camera rays and random rays, and which points are inside, against Embree's single rays
/// whose filter counts and rejects each hit. Every peer is the fastest over Embree's instruction
/// sets, robust and fast scenes apart.
void bench_queries(const Rig& rig, const BenchScene& scene);

}  // namespace mray::bench
