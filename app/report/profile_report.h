// The results of `profile`, without policies.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "app/report/json_parts.h"
#include "common/frame_times.h"
#include "common/report/table.h"

namespace mray::app {

struct ProfileRow {
    double frame = 0;
    std::string backend;
    /// Medians.
    FrameTimes times;
    double trace_rebuilt_ms = 0;
    double sah_cost = 0;
    double rebuilt_sah_cost = 0;
    /// Milliseconds of all runs of "deform", "upload", "refit", "update" (upload and refit of each
    /// run together), "rebuild", "trace" and "trace_rebuilt" (of the rebuilt tree instead of the
    /// refitted one).
    std::map<std::string, std::vector<double>> samples;
};

struct ProfileReport {
    ReportHead head;
    std::string rays;
    int repeat = 0;
    /// The most memory that the process held, both backends and the trees that it compares
    /// included.
    std::uint64_t peak_memory_bytes = 0;
    std::vector<ProfileRow> rows;
    /// The given options that decide what is measured.
    std::string options;
};

Json json_of(const ProfileReport& report);

/// A row of medians for each frame and backend, of at most 80 columns.
Table profile_table(const ProfileReport& report);

}  // namespace mray::app
