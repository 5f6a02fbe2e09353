// The results of `profile`, without policies.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "app/report/report_head.h"
#include "common/frame_times.h"

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
};

/// A kind of samples by the name that it has in JSON.
struct SampleKind {
    const char* name;
    std::vector<double> StageSamples::*samples;
};
inline constexpr std::array<SampleKind, 7> kSampleKinds = {
    {{"deform", &StageSamples::deform},
     {"upload", &StageSamples::upload},
     {"refit", &StageSamples::refit},
     {"update", &StageSamples::update},
     {"rebuild", &StageSamples::rebuild},
     {"trace", &StageSamples::trace},
     {"trace_rebuilt", &StageSamples::trace_rebuilt}}};

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
    /// The given options that decide what is measured.
    std::string options;
};

std::string to_json(const ProfileReport& report);

}  // namespace mray::app
