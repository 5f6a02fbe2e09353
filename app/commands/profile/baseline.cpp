#include <fmt/format.h>

#include "app/commands/profile/parts.h"
#include "common/base/errors.h"
#include "common/base/input_file.h"
#include "common/report/spread.h"
#include "common/report/table.h"
#include "common/text/text_parts.h"

namespace mray::app {
namespace {

constexpr std::uint64_t kMostBytes = 1 << 26;
/// Times below are too short for the clock and the scheduler.
constexpr double kShortestMs = 0.02;

constexpr const char* kStages[] = {"update", "rebuild", "trace", "trace_rebuilt"};

[[noreturn]] void refuse(const std::string& file, const std::string& why) {
    throw Error(ErrorKind::kBadInput, "{}: {}; give a file that `profile --json` wrote",
                escape(file), why);
}

/// The times of a stage in all frames, run by run; none if frames have different numbers of runs.
std::vector<double> times_of(const Json& report, const std::string& backend, const char* stage) {
    std::vector<double> times;
    for (const Json& frame : report.at("frames")) {
        if (frame.at("backend") != backend) continue;
        const auto samples = frame.at("samples_ms").at(stage).get<std::vector<double>>();
        if (times.empty()) times.resize(samples.size());
        if (samples.size() != times.size()) return {};
        for (std::size_t run = 0; run < times.size(); ++run) times[run] += samples[run];
    }
    return times;
}

void require_same_work(const std::string& file, const Json& baseline, const Json& report,
                       std::span<const std::string> backends, std::span<const double> frames) {
    for (const char* key :
         {"command", "scene", "triangles", "width", "height", "rays", "options"}) {
        if (baseline.at(key) != report.at(key))
            refuse(file, fmt::format("is of {} {}, but this run of {}", key,
                                     baseline.at(key).dump(), report.at(key).dump()));
    }
    std::vector<std::pair<double, std::string>> expected, given;
    for (const std::string& backend : backends)
        for (const double frame : frames) expected.emplace_back(frame, backend);
    for (const Json& frame : baseline.at("frames"))
        given.emplace_back(frame.at("frame").get<double>(), frame.at("backend").get<std::string>());
    if (given != expected) refuse(file, "has other frames or backends than this run");
    for (const std::string& backend : backends)
        for (const char* stage : kStages)
            if (times_of(baseline, backend, stage).empty())
                refuse(file, "has stages with different numbers of runs");
}

}  // namespace

Json read_baseline(const std::string& file, const Json& report,
                   std::span<const std::string> backends, std::span<const double> frames) {
    Json baseline = Json::parse(read_input_file(file, kMostBytes), nullptr, false);
    if (baseline.is_discarded()) refuse(file, "is not JSON");
    try {
        require_same_work(file, baseline, report, backends, frames);
    } catch (const Json::exception&) {
        refuse(file, "lacks a member");
    }
    return baseline;
}

BaselineComparison compare_with_baseline(const std::string& file, const Json& baseline,
                                         const Json& report, double tolerance_percent) {
    Table table({"stage", "backend", "before ms", "spread %", "now ms", "spread %", "change %"});
    std::string slower;
    std::string backend;
    for (const Json& frame : report.at("frames")) {
        if (frame.at("backend") == backend) continue;
        backend = frame.at("backend");
        for (const char* stage : kStages) {
            const Spread before = spread_of(times_of(baseline, backend, stage));
            const Spread now = spread_of(times_of(report, backend, stage));
            const double percent = before.median > 0 ? 100 * (now.median / before.median - 1) : 0;
            const auto ms = [](double value) { return fmt::format("{:.3f}", value); };
            const auto in_percent = [](double value) { return fmt::format("{:.1f}", value); };
            table.add({stage, backend, ms(before.median), in_percent(before.percent),
                       ms(now.median), in_percent(now.percent), in_percent(percent)});
            if (now.median >= kShortestMs &&
                now.median > before.median * (1 + tolerance_percent / 100))
                slower += fmt::format("{}{} on {}", slower.empty() ? "" : ", ", stage, backend);
        }
    }
    const std::string verdict =
        fmt::format("more than {}% slower than in {} (morphray {}): {}", tolerance_percent,
                    escape(file), baseline.value("version", ""), slower.empty() ? "none" : slower);
    return {fmt::format("\nmedians of all frames together\n{}{}\n", table.text(), verdict), verdict,
            !slower.empty()};
}

}  // namespace mray::app
