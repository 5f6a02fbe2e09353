// Rows as a table for a terminal and as comma-separated values.
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

/// The head as lines that begin with #, then RFC 4180 with \n.
std::string to_csv(const ReportHead& head, std::span<const Row> rows);

}  // namespace mray::bench
