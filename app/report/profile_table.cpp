#include "app/report/profile_table.h"

#include <fmt/format.h>

#include "common/text/message_text.h"

namespace mray::app {
namespace {

std::string fixed(double value) { return fmt::format("{:.3f}", value); }

/// At most 7 characters below ten million.
std::string brief(double value) {
    const int digits = value < 999.9995 ? 3 : value < 9999.995 ? 2 : value < 99999.95 ? 1 : 0;
    return fmt::format("{:.{}f}", value, digits);
}

double mrays(const ProfileRow& row, double ms) {
    return static_cast<double>(row.times.rays) / (ms * 1e3 + 1e-9);
}

std::string signed_percent(double percent) {
    if (percent > 99999) return ">+99999";
    return fmt::format("{:+.1f}", percent);
}

}  // namespace

std::size_t BaselineReport::slower_stages() const {
    return static_cast<std::size_t>(std::ranges::count_if(
        stages, [this](const StageChange& stage) { return is_slower(stage); }));
}

Table profile_table(const ProfileReport& report) {
    Table table({"frame", "backend", "deform ms", "upload ms", "refit ms", "refit ns/tri",
                 "rebuild ms", "rebuild ns/tri", "trace ms", "Mray/s", "SAH cost",
                 "rebuilt trace ms", "rebuilt Mray/s", "rebuilt SAH cost", "yardstick ms"});
    const auto triangles = static_cast<double>(std::max<std::uint64_t>(1, report.head.triangles));
    for (const ProfileRow& row : report.rows) {
        const FrameTimes& t = row.times;
        table.add({fmt::format("{}", row.frame), row.backend, fixed(t.deform_ms),
                   fixed(t.update.upload_ms), fixed(t.update.refit_ms),
                   fixed(t.update.refit_ms * 1e6 / triangles), fixed(t.update.rebuild_ms),
                   fixed(t.update.rebuild_ms * 1e6 / triangles), fixed(t.trace_ms),
                   fixed(mrays(row, t.trace_ms)), fixed(row.sah_cost), fixed(row.trace_rebuilt_ms),
                   fixed(mrays(row, row.trace_rebuilt_ms)), fixed(row.rebuilt_sah_cost),
                   fixed(row.yardstick_ms)});
    }
    return table;
}

std::string profile_text(const ProfileReport& report) {
    Table table({"frame", "backend", "deform", "upload", "refit", "rebuild", "trace", "Mray/s",
                 "SAH cost", "new trace", "new SAH"});
    for (const ProfileRow& row : report.rows) {
        const FrameTimes& t = row.times;
        table.add({fmt::format("{}", row.frame), row.backend, brief(t.deform_ms),
                   brief(t.update.upload_ms), brief(t.update.refit_ms), brief(t.update.rebuild_ms),
                   brief(t.trace_ms), brief(mrays(row, t.trace_ms)), brief(row.sah_cost),
                   brief(row.trace_rebuilt_ms), brief(row.rebuilt_sah_cost)});
    }
    return "times in ms; new: with the tree that rebuild makes, instead of the refitted one\n" +
           table.text();
}

const char* name_of_verdict(const BaselineReport& report, const StageChange& stage) {
    if (stage.is_too_short) return "too short";
    if (report.is_slower(stage)) return "slower";
    return stage.percent() < -report.tolerance_percent ? "faster" : "ok";
}

std::string baseline_text(const BaselineReport& report) {
    Table table({"stage", "backend", "expected ms", "measured ms", "change %", "worst frame",
                 "there %", "verdict"});
    for (const StageChange& stage : report.stages) {
        table.add({stage.stage, stage.backend, brief(stage.expected_ms), brief(stage.measured_ms),
                   signed_percent(stage.percent()), fmt::format("{}", stage.worst_frame),
                   signed_percent(stage.worst_percent), name_of_verdict(report, stage)});
    }
    const std::size_t slower = report.slower_stages();
    return fmt::format(
        "expected: as in the baseline, by the yardstick of both runs\n{}{} of {} stages more than "
        "{}% slower than in {} (morphray {})\n",
        table.text(), slower == 0 ? "none" : fmt::format("{}", slower), report.stages.size(),
        report.tolerance_percent, shown(report.file), report.version);
}

}  // namespace mray::app
