// Rows of the report, each of one method of morphray compared with one peer.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "common/report/table.h"
#include "lab/bench/interleave.h"

namespace mray::bench {

/// The processor's name, family and model, and how many cores: names alone do not tell generations
/// apart.
std::string machine_name();

/// The widest vector instructions of this machine: "AVX-512", "AVX2", "SSE4.1", or "".
std::string machine_isa();

/// The unit of a figure: kNs is the time of one triangle or query. More is better for
/// kMrayPerSecond, less for the others.
enum class Unit { kMrayPerSecond, kNs, kMs };

struct Row {
    /// primary, shadow, diffuse, ao, one-ray, refit, build or frame, or the name of a query.
    std::string work;
    /// The method of morphray, and that which it is compared with.
    std::string tracer;
    std::string peer;
    Unit unit = Unit::kMs;
    /// In `unit`, from the medians of the parts.
    double ours = 0;
    double theirs = 0;
    /// Above 1 if morphray is faster, in any unit: from the medians, and from the least times.
    double ratio = 0;
    double at_best = 0;
    /// How many answers differ.
    std::uint64_t differences = 0;
};

/// Fills in the figures. `count` is the number of rays, triangles or queries of a run.
void set_times(Row& row, const Times& ours, const Times& theirs, Unit unit, std::uint64_t count);

/// Prints rows, and writes them to a file as comma-separated values (RFC 4180 with \n). The file is
/// written with each row, so that a run that is ended leaves what it has measured.
class Report {
public:
    /// `head` is printed first, and begins the file. Without a name there is no file. Throws Error
    /// if it cannot be written.
    Report(std::string head, std::string file);

    /// The following rows are about this scene, on so many threads.
    void begin(const std::string& scene, int threads);
    void add(const Row& row);

private:
    std::string head_;
    std::string file_;
    std::string scene_;
    int threads_ = 0;
    Table table_;
};

}  // namespace mray::bench
