// A row of the report: one method of morphray compared with one peer.
#pragma once

#include <cstdint>
#include <string>

#include "lab/bench/compare_answers.h"
#include "lab/bench/interleave.h"

namespace mray::bench {

/// The unit of a figure. More is better for kMrayPerSecond, less for the others.
enum class Unit { kMrayPerSecond, kNsPerTriangle, kNsPerQuery, kMs };

struct Row {
    std::string scene;
    std::uint64_t triangles = 0;
    /// fill, whole or inside
    std::string view;
    /// primary, shadow, diffuse, ao-N, one-ray, refit, build, queries or frame
    std::string work;
    int threads = 0;
    /// Rays that were traced, or points asked about; 0 for refits and builds.
    std::uint64_t rays = 0;
    /// The share of rays that hit something, or of points that have an answer or are inside, from 0
    /// to 1.
    double hit_share = 0;
    std::string tracer;
    std::string target;
    std::string peer;
    Unit unit = Unit::kMs;
    /// From the medians of the parts, in `unit`.
    double ours = 0;
    double peer_value = 0;
    /// From the least times of the parts.
    double ours_at_best = 0;
    double peer_at_best = 0;
    /// Above 1 if morphray is faster, in any unit.
    Ratio ratio = {};
    Mismatches mismatches;
    /// The largest difference of distances to closest points, as a part of the scene's extent; 0 in
    /// other rows.
    double largest_difference = 0;
};

/// "Mray/s", "ns/triangle", "ns/query", "ms"
const char* name_of(Unit unit);

/// Fills in the figures. `count` is the number of rays, triangles or queries of a run.
void set_times(Row& row, const Times& ours, const Times& peer, Unit unit, std::uint64_t count);

}  // namespace mray::bench
