#include "app/commands/profile/baseline.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "app/commands/profile/yardstick.h"
#include "app/files/json_file.h"
#include "common/base/errors.h"
#include "common/text/message_text.h"

namespace mray::app {
namespace {

constexpr const char* kCommand = "profile --json";
constexpr std::uint64_t kMostBytes = 1 << 26;
constexpr const char* kSchema = "morphray/1";
/// Times below are too short for the clock and the scheduler.
constexpr double kShortestMs = 0.02;
/// Keeps ratios finite.
constexpr double kLeastMs = 1e-9;

struct Stage {
    const char* name;
    double ProfileRow::*least_ms;
};

constexpr std::array<Stage, 4> kStages = {
    {{"update", &ProfileRow::least_update_ms},
     {"rebuild", &ProfileRow::least_rebuild_ms},
     {"trace", &ProfileRow::least_trace_ms},
     {"trace, rebuilt", &ProfileRow::least_trace_rebuilt_ms}}};

[[noreturn]] void refuse(const std::string& why) { throw std::invalid_argument(why); }

JsonAt member(const JsonAt& json, const char* name) {
    const std::optional<JsonAt> found = json.is_object() ? json.find(name) : std::nullopt;
    if (!found) refuse(fmt::format("lacks the member {}", name));
    return *found;
}

std::string text_of(const JsonAt& json, const char* name) {
    const JsonAt value = member(json, name);
    if (!value.is_text()) refuse(fmt::format("has a {} that is not a text", name));
    return std::string(value.text());
}

std::uint64_t count_of(const JsonAt& json, const char* name) {
    const std::optional<std::uint64_t> count = member(json, name).unsigned_integer();
    if (!count) refuse(fmt::format("has a {} that is not a count", name));
    return *count;
}

double number_of(const JsonAt& json, const char* name) {
    const JsonAt value = member(json, name);
    if (!value.is_number() || !std::isfinite(value.number()))
        refuse(fmt::format("has a {} that is not a number", name));
    return value.number();
}

double time_of(const JsonAt& json, const char* name) {
    const double ms = number_of(json, name);
    if (ms < 0) refuse(fmt::format("has a {} below 0", name));
    return ms;
}

ProfileRow row_of(const JsonAt& json) {
    ProfileRow row;
    row.frame = number_of(json, "frame");
    row.backend = text_of(json, "backend");
    const JsonAt least = member(json, "least_ms");
    row.least_update_ms = time_of(least, "update");
    row.least_rebuild_ms = time_of(least, "rebuild");
    row.least_trace_ms = time_of(least, "trace");
    row.least_trace_rebuilt_ms = time_of(least, "trace_rebuilt");
    row.yardstick_ms = time_of(json, "yardstick_ms");
    if (row.yardstick_ms <= 0) refuse("has a yardstick_ms that is not above 0");
    return row;
}

/// The report without what only tables show.
ProfileReport report_of(const JsonAt& json) {
    const std::string schema = text_of(json, "schema");
    if (schema != kSchema) refuse(fmt::format("has the schema {}, not {}", shown(schema), kSchema));
    if (text_of(json, "command") != "profile" || json.find("policies"))
        refuse("is another report than of the times of stages");
    if (!json.find("yardstick"))
        refuse("has no yardstick; measure the baseline again with this version");
    ProfileReport report;
    report.version = text_of(json, "version");
    report.yardstick = text_of(json, "yardstick");
    report.head.scene = text_of(json, "scene");
    report.head.triangles = count_of(json, "triangles");
    report.head.vertices = count_of(json, "vertices");
    report.head.width = static_cast<std::uint32_t>(count_of(json, "width"));
    report.head.height = static_cast<std::uint32_t>(count_of(json, "height"));
    report.rays = text_of(json, "rays");
    report.options = text_of(json, "options");
    const JsonAt complete = member(json, "complete");
    if (!complete.is_boolean() || !complete.boolean()) refuse("is of a run that was cut short");
    const JsonAt frames = member(json, "frames");
    if (!frames.is_array()) refuse("lacks the member frame");
    for (std::size_t i = 0; i < frames.size(); ++i) report.rows.push_back(row_of(frames[i]));
    return report;
}

/// Throws what is another in the baseline than in this run.
[[noreturn]] void refuse_other(const std::string& file, const std::string& what) {
    throw Error(ErrorKind::kBadInput,
                fmt::format("{}: {}; give a report of the same scene, frames and options",
                            shown(file), what));
}

/// Throws for the first difference in what is measured.
void require_equal(const std::string& file, const ProfileReport& then, const ProfileReport& now) {
    const auto compare = [&file](const char* what, const std::string& was, const std::string& is) {
        if (was == is) return;
        refuse_other(
            file, fmt::format("{} differ: {} there, {} here", what,
                              was.empty() ? "none" : shown(was), is.empty() ? "none" : shown(is)));
    };
    const auto size = [](const ReportHead& head) {
        return fmt::format("{}x{}", head.width, head.height);
    };
    const auto text = [](std::uint64_t count) { return fmt::format("{}", count); };
    compare("yardsticks", then.yardstick, now.yardstick);
    compare("scenes", then.head.scene, now.head.scene);
    compare("numbers of triangles", text(then.head.triangles), text(now.head.triangles));
    compare("numbers of vertices", text(then.head.vertices), text(now.head.vertices));
    compare("sizes", size(then.head), size(now.head));
    compare("kinds of rays", then.rays, now.rays);
    compare("options", then.options, now.options);
}

const ProfileRow* find_row(const ProfileReport& report, double frame, const std::string& backend) {
    const auto row = std::ranges::find_if(
        report.rows, [&](const ProfileRow& r) { return r.frame == frame && r.backend == backend; });
    return row == report.rows.end() ? nullptr : &*row;
}

StageChange change_of(const Stage& stage, const std::string& backend, const ProfileReport& baseline,
                      const ProfileReport& report) {
    struct Change {
        double frame;
        double expected_ms;
        double measured_ms;
        double ratio;
    };
    std::vector<Change> changes;
    for (const ProfileRow& now : report.rows) {
        if (now.backend != backend) continue;
        const ProfileRow& then = *find_row(baseline, now.frame, backend);
        const double expected = then.*stage.least_ms * now.yardstick_ms / then.yardstick_ms;
        const double measured = now.*stage.least_ms;
        changes.push_back({now.frame, expected, measured, measured / std::max(expected, kLeastMs)});
    }
    std::ranges::stable_sort(changes, {}, &Change::ratio);
    const Change& middle = changes[changes.size() / 2];
    const Change& worst = changes.back();
    return {backend,
            stage.name,
            middle.expected_ms,
            middle.measured_ms,
            worst.frame,
            100 * (worst.ratio - 1),
            std::max(middle.expected_ms, middle.measured_ms) < kShortestMs};
}

}  // namespace

ProfileReport read_baseline(const std::string& file, const ProfileReport& report) {
    return read_json_file(file, kMostBytes, kCommand, [&](const JsonAt& json) {
        ProfileReport baseline = report_of(json);
        require_equal(file, baseline, report);
        return baseline;
    });
}

void require_frames(const std::string& file, const ProfileReport& baseline,
                    const std::string& backend, std::span<const double> frames) {
    for (const double frame : frames) {
        if (find_row(baseline, frame, backend) == nullptr)
            refuse_other(file, fmt::format("has no frame {} on {}", frame, backend));
    }
    for (const ProfileRow& row : baseline.rows) {
        if (row.backend == backend && std::ranges::find(frames, row.frame) == frames.end()) {
            refuse_other(file, fmt::format("has frame {}, which this run has not", row.frame));
        }
    }
}

void require_backends(const std::string& file, const ProfileReport& baseline,
                      const std::vector<std::string>& backends) {
    for (const ProfileRow& row : baseline.rows) {
        if (std::ranges::find(backends, row.backend) != backends.end()) continue;
        refuse_other(file,
                     fmt::format("has times of {}, which this run has not", shown(row.backend)));
    }
}

BaselineReport compare_with_baseline(const std::string& file, const ProfileReport& baseline,
                                     const ProfileReport& report, double tolerance_percent) {
    BaselineReport result{file, baseline.version, tolerance_percent, {}};
    std::vector<std::string> backends;
    for (const ProfileRow& row : report.rows) {
        if (std::ranges::find(backends, row.backend) == backends.end())
            backends.push_back(row.backend);
    }
    for (const std::string& backend : backends) {
        for (const Stage& stage : kStages)
            result.stages.push_back(change_of(stage, backend, baseline, report));
    }
    return result;
}

}  // namespace mray::app
