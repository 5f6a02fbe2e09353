// The results of `profile`, without policies.
#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "app/report/report_head.h"
#include "common/frame_times.h"

namespace mray::app {

/// Medians of one frame on one backend.
struct ProfileRow {
    double frame = 0;
    std::string backend;
    FrameTimes times;
    /// Tracing the rebuilt tree instead of the refitted one.
    double trace_rebuilt_ms = 0;
    double sah_cost = 0;
    double rebuilt_sah_cost = 0;
    /// The least times, which the load of the machine disturbs least.
    double least_update_ms = 0;
    double least_rebuild_ms = 0;
    double least_trace_ms = 0;
    double least_trace_rebuilt_ms = 0;
    /// The least time of the yardstick between the stages.
    double yardstick_ms = 0;
};

/// A stage on one backend compared with that of an earlier run, by least times: at the frame whose
/// change is the median, of an even number of frames the larger one in the middle.
struct StageChange {
    std::string backend;
    /// "update", "rebuild", "trace" or "trace, rebuilt".
    std::string stage;
    /// The stage's time in the baseline, in units of its yardstick, times this run's yardstick.
    double expected_ms = 0;
    double measured_ms = 0;
    /// The frame that became slower by most, and by how much.
    double worst_frame = 0;
    double worst_percent = 0;
    /// Whether the times are too short to be compared.
    bool is_too_short = false;

    /// The change, which is positive if the stage became slower.
    double percent() const { return 100 * (measured_ms / std::max(expected_ms, 1e-9) - 1); }
};

/// A run compared with an earlier one.
struct BaselineReport {
    std::string file;
    /// The version of the program that wrote the file.
    std::string version;
    double tolerance_percent = 0;
    std::vector<StageChange> stages;

    bool is_slower(const StageChange& stage) const {
        return !stage.is_too_short && stage.percent() > tolerance_percent;
    }
    std::size_t slower_stages() const;
};

struct ProfileReport {
    ReportHead head;
    std::string rays;
    int repeat = 0;
    bool complete = true;
    /// The most memory that the process held, both backends and the trees that it compares
    /// included.
    std::uint64_t peak_memory_bytes = 0;
    std::vector<ProfileRow> rows;
    /// The version of the program.
    std::string version;
    /// The kind of yardstick.
    std::string yardstick;
    /// The given options that decide what is measured.
    std::string options;
    std::optional<BaselineReport> baseline;
};

std::string to_json(const ProfileReport& report);

}  // namespace mray::app
