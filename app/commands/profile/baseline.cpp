#include "app/commands/profile/baseline.h"

#include <fmt/format.h>

#include <array>

#include "app/files/json_file.h"
#include "common/report/spread.h"
#include "common/report/table.h"
#include "common/text/text_parts.h"

namespace mray::app {
namespace {

constexpr std::uint64_t kMostBytes = 1 << 26;
/// Times below are too short for the clock and the scheduler.
constexpr double kShortestMs = 0.02;

constexpr std::array<SampleKind, 4> kStages = {{{"update", &StageSamples::update},
                                                {"rebuild", &StageSamples::rebuild},
                                                {"trace", &StageSamples::trace},
                                                {"trace_rebuilt", &StageSamples::trace_rebuilt}}};

[[noreturn]] void refuse(const std::string& why) { throw std::invalid_argument(why); }

ProfileReport report_of(const JsonAt& json) {
    if (!is_report_of("profile", json) || json.find("policies"))
        refuse("is another report than of the times of stages");
    if (!json.at("complete").boolean()) refuse("is of a run that was cut short");
    ProfileReport report;
    report.version = json.at("version").text();
    report.head.scene = json.at("scene").text();
    report.head.triangles = json.at("triangles").count();
    report.head.width = static_cast<std::uint32_t>(json.at("width").count());
    report.head.height = static_cast<std::uint32_t>(json.at("height").count());
    report.rays = json.at("rays").text();
    report.options = json.at("options").text();
    const JsonAt frames = json.at("frames");
    for (std::size_t i = 0; i < frames.size(); ++i) {
        ProfileRow& row = report.rows.emplace_back();
        row.frame = frames[i].at("frame").number();
        row.backend = frames[i].at("backend").text();
        for (const SampleKind& stage : kStages) {
            const JsonAt samples = frames[i].at("samples_ms").at(stage.name);
            report.repeat = static_cast<int>(samples.size());
            std::vector<double>& times = row.samples.*stage.samples;
            times.resize(samples.size());
            samples.numbers(times);
            if (times.empty() || times.size() != report.rows.front().samples.update.size())
                refuse("has stages with different numbers of runs");
        }
    }
    return report;
}

/// The text by which runs are compared.
std::string measured_work(const ProfileReport& report) {
    return fmt::format("scene {}, {} triangles, {}x{}, rays {}, options {}",
                       quote(report.head.scene), report.head.triangles, report.head.width,
                       report.head.height, quote(report.rays), quote(report.options));
}

void require_rows(const ProfileReport& report, std::span<const std::string> backends,
                  std::span<const double> frames) {
    const std::vector<ProfileRow>& rows = report.rows;
    bool are_equal = rows.size() == backends.size() * frames.size();
    for (std::size_t i = 0; are_equal && i < rows.size(); ++i) {
        are_equal = rows[i].frame == frames[i % frames.size()] &&
                    rows[i].backend == backends[i / frames.size()];
    }
    if (!are_equal) refuse("has other frames or backends than this run");
}

/// The times of a stage in all frames, run by run.
Spread spread_of_stage(const ProfileReport& report, const std::string& backend,
                       std::vector<double> StageSamples::*stage) {
    std::vector<double> times(static_cast<std::size_t>(report.repeat));
    for (const ProfileRow& row : report.rows) {
        if (row.backend != backend) continue;
        for (std::size_t run = 0; run < times.size(); ++run)
            times[run] += (row.samples.*stage)[run];
    }
    return spread_of(times);
}

}  // namespace

ProfileReport read_baseline(const std::string& file, const ProfileReport& report,
                            std::span<const std::string> backends, std::span<const double> frames) {
    return read_json_file(file, kMostBytes, "profile --json", [&](const JsonAt& json) {
        ProfileReport baseline = report_of(json);
        const std::string before = measured_work(baseline), now = measured_work(report);
        if (before != now) refuse(fmt::format("is of {}, but this run is of {}", before, now));
        require_rows(baseline, backends, frames);
        return baseline;
    });
}

BaselineComparison compare_with_baseline(const std::string& file, const ProfileReport& baseline,
                                         const ProfileReport& report, double tolerance_percent) {
    Table table({"stage", "backend", "before ms", "spread %", "now ms", "spread %", "change %"});
    std::string slower;
    std::string backend;
    for (const ProfileRow& row : report.rows) {
        if (row.backend == backend) continue;
        backend = row.backend;
        for (const SampleKind& stage : kStages) {
            const Spread before = spread_of_stage(baseline, backend, stage.samples);
            const Spread now = spread_of_stage(report, backend, stage.samples);
            const double percent = before.median > 0 ? 100 * (now.median / before.median - 1) : 0;
            const auto ms = [](double value) { return fmt::format("{:.3f}", value); };
            const auto in_percent = [](double value) { return fmt::format("{:.1f}", value); };
            table.add({stage.name, backend, ms(before.median), in_percent(before.percent),
                       ms(now.median), in_percent(now.percent), in_percent(percent)});
            if (now.median >= kShortestMs &&
                now.median > before.median * (1 + tolerance_percent / 100))
                slower +=
                    fmt::format("{}{} on {}", slower.empty() ? "" : ", ", stage.name, backend);
        }
    }
    return {fmt::format("medians of all frames together\n{}more than {}% slower than in {} "
                        "(morphray {}): {}\n",
                        table.text(), tolerance_percent, escape(file), baseline.version,
                        slower.empty() ? "none" : slower),
            !slower.empty()};
}

}  // namespace mray::app
