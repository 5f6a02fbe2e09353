// Rows of the report, each of one method of morphray compared with one peer.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "lab/bench/interleave.h"

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
    /// primary, shadow, diffuse, ao, one-ray, refit, build, queries or frame
    std::string work;
    int threads = 0;
    /// Rays that were traced, or points asked about; 0 for refits and builds.
    std::uint64_t rays = 0;
    /// The share of rays that hit something, or of points that have an answer or are inside, from 0
    /// to 1.
    double hit_share = 0;
    std::string tracer;
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
    /// Rays or points with other answers.
    std::uint64_t mismatches = 0;
};

/// Fills in the figures. `count` is the number of rays, triangles or queries of a run.
void set_times(Row& row, const Times& ours, const Times& peer, Unit unit, std::uint64_t count);

/// Prints rows, and writes them to a file as comma-separated values (RFC 4180 with \n). The file is
/// written with each row, so that a run that is ended leaves what it has measured.
class Report {
public:
    /// `head` is printed first, and begins the file. Without a name there is no file. Throws Error
    /// if it cannot be written.
    Report(std::string head, std::string file);

    void begin_scene() const;
    void add(const Row& row);

private:
    std::string head_;
    std::string file_;
    std::vector<Row> rows_;
};

}  // namespace mray::bench
