#include "app/report/profile_table.h"

#include <fmt/format.h>

#include <algorithm>

#include "common/report/spread.h"

namespace mray::app {
namespace {

std::string fixed(double value) { return fmt::format("{:.3f}", value); }

/// At most 7 characters, for values below 1e100.
std::string brief(double value) {
    if (value > 9'999'999) return fmt::format("{:.1e}", value);
    const int digits = value < 999.9995 ? 3 : value < 9999.995 ? 2 : value < 99999.95 ? 1 : 0;
    return fmt::format("{:.{}f}", value, digits);
}

struct ShownStage {
    const char* name;
    const char* csv_name;
    std::vector<double> StageSamples::*samples;
};
constexpr std::array<ShownStage, 6> kShownStages = {
    {{"deform", "deform", &StageSamples::deform},
     {"upload", "upload", &StageSamples::upload},
     {"refit", "refit", &StageSamples::refit},
     {"rebuild", "rebuild", &StageSamples::rebuild},
     {"trace", "trace", &StageSamples::trace},
     {"new trace", "rebuilt trace", &StageSamples::trace_rebuilt}}};

double mrays(const ProfileRow& row, double ms) {
    return static_cast<double>(row.times.rays) / (ms * 1e3 + 1e-9);
}

}  // namespace

Table profile_table(const ProfileReport& report) {
    std::vector<std::string> header = {
        "frame",        "backend",          "deform ms",      "upload ms",       "refit ms",
        "refit ns/tri", "rebuild ms",       "rebuild ns/tri", "trace ms",        "Mray/s",
        "SAH cost",     "rebuilt trace ms", "rebuilt Mray/s", "rebuilt SAH cost"};
    for (const ShownStage& stage : kShownStages) {
        header.push_back(fmt::format("least {} ms", stage.csv_name));
        header.push_back(fmt::format("{} spread %", stage.csv_name));
    }
    Table table(header);
    const auto triangles = static_cast<double>(std::max<std::uint64_t>(1, report.head.triangles));
    for (const ProfileRow& row : report.rows) {
        const FrameTimes& t = row.times;
        std::vector<std::string> cells = {fmt::format("{}", row.frame),
                                          row.backend,
                                          fixed(t.deform_ms),
                                          fixed(t.update.upload_ms),
                                          fixed(t.update.refit_ms),
                                          fixed(t.update.refit_ms * 1e6 / triangles),
                                          fixed(t.update.rebuild_ms),
                                          fixed(t.update.rebuild_ms * 1e6 / triangles),
                                          fixed(t.trace_ms),
                                          fixed(mrays(row, t.trace_ms)),
                                          fixed(row.sah_cost),
                                          fixed(row.trace_rebuilt_ms),
                                          fixed(mrays(row, row.trace_rebuilt_ms)),
                                          fixed(row.rebuilt_sah_cost)};
        for (const ShownStage& stage : kShownStages) {
            const Spread spread = spread_of(row.samples.*stage.samples);
            cells.push_back(fixed(spread.least));
            cells.push_back(fmt::format("{:.1f}", spread.percent));
        }
        table.add(cells);
    }
    return table;
}

ProfileLines::ProfileLines(int repeat, std::span<const double> frames) : repeat_(repeat) {
    std::size_t frame_width = 0;
    for (const double frame : frames)
        frame_width = std::max(frame_width, fmt::format("{}", frame).size());
    columns_ = {{"frame", frame_width}, {"backend", 0, false}, {"stage", 9, false}, {"least", 7},
                {"median", 7},          {"spread %"},          {"Mray/s", 7},       {"SAH cost"}};
}

std::string ProfileLines::header() const {
    return fmt::format(
        "times in ms of {} {}; spread: the middle half of the runs, in percent of the median\n"
        "new trace: with the tree that rebuild makes, instead of the refitted one\n{}",
        repeat_, repeat_ == 1 ? "run" : "runs", header_text(columns_));
}

std::string ProfileLines::rows(const ProfileRow& row) const {
    std::string text;
    for (const ShownStage& stage : kShownStages) {
        const Spread spread = spread_of(row.samples.*stage.samples);
        const bool is_trace = stage.samples == &StageSamples::trace;
        const bool is_new_trace = stage.samples == &StageSamples::trace_rebuilt;
        text +=
            row_text(columns_,
                     std::vector<std::string>{
                         fmt::format("{}", row.frame), row.backend, stage.name, brief(spread.least),
                         brief(spread.median), fmt::format("{:.1f}", spread.percent),
                         is_trace || is_new_trace ? brief(mrays(row, spread.median)) : "",
                         is_trace       ? brief(row.sah_cost)
                         : is_new_trace ? brief(row.rebuilt_sah_cost)
                                        : ""});
    }
    return text;
}

}  // namespace mray::app
