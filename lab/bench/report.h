// Rows as a table for a terminal, as JSON and as comma-separated values.
#pragma once

#include <span>
#include <string>

#include "lab/bench/row.h"

namespace mray::bench {

/// Facts about all rows.
struct ReportHead {
    std::string machine;
    std::string isa;
    std::string embree;
    /// Ways to trace that this Embree lacks, as EmbreeDevice::left_out.
    std::string left_out;
    std::string version;
    /// The shell command that repeats the run.
    std::string command;
};

std::string table_header();
std::string table_line(const Row& row);

/// {"schema": "morphray-bench/2", "machine", "isa", "embree", "left_out", "version", "command",
/// "built_with", "rows": [...]}; a row has scene, triangles, view, work, threads, rays, hit_share,
/// tracer, target, unit, ours, peer, peer_value, ratio, ours_at_best, peer_at_best, ratio_at_best,
/// ratio_min, ratio_max, mismatches (rays), mismatch_kinds (hit, prim_id, t) and
/// largest_difference.
std::string to_json(const ReportHead& head, std::span<const Row> rows);

/// The head as lines that begin with #, then RFC 4180 with \n.
std::string to_csv(const ReportHead& head, std::span<const Row> rows);

}  // namespace mray::bench
