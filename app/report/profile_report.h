// The results of `profile`, without policies.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "app/report/report_head.h"
#include "common/frame_times.h"
#include "tools/measure/change.h"

namespace mray::app {

/// Milliseconds of all runs of the stages of one frame on one backend, in the order of the runs.
struct StageSamples {
    std::vector<double> deform;
    std::vector<double> upload;
    std::vector<double> refit;
    /// Upload and refit of each run together.
    std::vector<double> update;
    std::vector<double> rebuild;
    std::vector<double> trace;
    /// Tracing the rebuilt tree instead of the refitted one.
    std::vector<double> trace_rebuilt;
    /// The yardstick between the stages.
    std::vector<double> yardstick;
};

/// A kind of samples by the name that it has in JSON.
struct SampleKind {
    const char* name;
    std::vector<double> StageSamples::*samples;
};
inline constexpr std::array<SampleKind, 8> kSampleKinds = {
    {{"deform", &StageSamples::deform},
     {"upload", &StageSamples::upload},
     {"refit", &StageSamples::refit},
     {"update", &StageSamples::update},
     {"rebuild", &StageSamples::rebuild},
     {"trace", &StageSamples::trace},
     {"trace_rebuilt", &StageSamples::trace_rebuilt},
     {"yardstick", &StageSamples::yardstick}}};

/// One frame on one backend.
struct ProfileRow {
    double frame = 0;
    std::string backend;
    /// Medians.
    FrameTimes times;
    double trace_rebuilt_ms = 0;
    double sah_cost = 0;
    double rebuilt_sah_cost = 0;
    StageSamples samples;
};

enum class StageVerdict { kTooShort, kUnsure, kSame, kSlower, kFaster };

/// A stage on one backend compared with that of an earlier run.
struct StageChange {
    std::string backend;
    /// "update", "rebuild", "trace" or "trace, rebuilt".
    std::string stage;
    /// Medians at the frame whose ratio is the median, of an even number of frames the geometric
    /// mean of the two in the middle. The expected one is that of the baseline in units of its
    /// yardstick, times this run's yardstick.
    double expected_ms = 0;
    double measured_ms = 0;
    /// The ratio of medians to those expected, and the interval in which it lies with the chance
    /// BaselineReport::confidence, for all stages at a time.
    RatioInterval ratio;
    /// How likely the difference, in the direction of the ratio, is to come about by noise alone,
    /// corrected for the number of stages.
    double chance = 1;
    /// The frame that became slower by most, and by how much.
    double worst_frame = 0;
    double worst_percent = 0;
    StageVerdict verdict = StageVerdict::kUnsure;

    /// The change, which is positive if the stage became slower.
    double percent() const { return 100 * (ratio.ratio - 1); }
};

/// A run compared with an earlier one.
struct BaselineReport {
    std::string file;
    /// The version of the program that wrote the file.
    std::string version;
    double tolerance_percent = 0;
    /// Whether the file has all times, and not only the least ones. If not, their noise is taken
    /// for that of this run.
    bool has_samples = true;
    /// The confidence of all intervals together.
    double confidence = 0;
    /// The ratio that the load of the machine may explain; 1 on an idle machine.
    double load_factor = 1;
    /// The runs of a frame in this report and in the baseline.
    std::size_t runs = 0;
    std::size_t baseline_runs = 0;
    /// The least number of runs of both with which a stage can be called slower or faster.
    std::size_t least_runs = 0;
    /// Whether even the clearest change could come about by chance, because there are too few runs.
    bool has_too_few_runs = false;
    std::vector<StageChange> stages;

    std::size_t count(StageVerdict verdict) const;
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
    /// How busy the machine was: Yardstick::waited() and MachineLoad::others().
    double waited = 0;
    double others = 0;
    /// Whether the rows have all samples; if not, those of a baseline of an earlier version have
    /// the least times alone.
    bool has_samples = true;
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
