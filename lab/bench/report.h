// Rows of the report, each of one method of morphray compared with one peer.
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "lab/bench/interleave.h"
#include "lab/bench/trace_work.h"

namespace mray::bench {

/// The name of the results file: the processor's name, family and model, and how many cores; for
/// example "amd-epyc-family26-model2-2c". Names alone do not tell generations apart.
std::string machine_name();

/// The widest vector instructions of this machine: "AVX-512", "AVX2", "SSE4.1", or "".
std::string machine_isa();

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

/// Fills in the figures. `count` is the number of rays, triangles or queries of a run.
void set_times(Row& row, const Times& ours, const Times& peer, Unit unit, std::uint64_t count);

std::string table_header();
std::string table_line(const Row& row);

/// RFC 4180 with \n.
std::string to_csv(std::span<const Row> rows);

}  // namespace mray::bench
