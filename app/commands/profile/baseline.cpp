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
#include "tools/measure/change.h"
#include "tools/measure/median.h"
#include "tools/measure/spread.h"

namespace mray::app {
namespace {

constexpr const char* kCommand = "profile --json";
constexpr std::uint64_t kMostBytes = 1 << 26;
constexpr const char* kSchema = "morphray/1";
/// Times below are too short for the clock and the scheduler.
constexpr double kShortestMs = 0.02;
/// Keeps ratios finite.
constexpr double kLeastMs = 1e-9;
/// The chance that noise alone makes any of the stages slower or faster.
constexpr double kMostChance = 0.01;
/// The confidence of the intervals of all stages together.
constexpr double kConfidence = 0.95;
/// Below this part of the time that others take, the machine counts as idle.
constexpr double kIdleTaken = 0.05;
/// Keeps the factor finite.
constexpr double kMostTaken = 0.99;

/// A stage that is compared.
struct Stage {
    const char* name;
    const char* json_name;
    std::vector<double> StageSamples::*samples;
};

constexpr std::array<Stage, 4> kStages = {
    {{"update", "update", &StageSamples::update},
     {"rebuild", "rebuild", &StageSamples::rebuild},
     {"trace", "trace", &StageSamples::trace},
     {"trace, rebuilt", "trace_rebuilt", &StageSamples::trace_rebuilt}}};

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

double part_of(const JsonAt& json, const char* name) {
    const double part = number_of(json, name);
    if (part < 0 || part > 1) refuse(fmt::format("has a part {} that is not from 0 to 1", name));
    return part;
}

/// The times of one stage of a frame, or of the yardstick: those of all runs, or, in reports of
/// earlier versions, the least of them.
std::vector<double> samples_of(const JsonAt& row, const SampleKind& kind) {
    const JsonAt samples = member(member(row, "samples_ms"), kind.name);
    if (!samples.is_array() || samples.size() == 0)
        refuse(fmt::format("has samples_ms of {} that are not a list of times", kind.name));
    std::vector<double> times;
    for (std::size_t i = 0; i < samples.size(); ++i) {
        const JsonAt time = samples[i];
        if (!time.is_number() || !std::isfinite(time.number()) || time.number() < 0)
            refuse(fmt::format("has a sample of {} that is not a time", kind.name));
        times.push_back(time.number());
    }
    return times;
}

ProfileRow row_of(const JsonAt& json, bool has_samples) {
    ProfileRow row;
    row.frame = number_of(json, "frame");
    row.backend = text_of(json, "backend");
    const JsonAt least = member(json, "least_ms");
    for (const Stage& stage : kStages)
        (row.samples.*stage.samples).push_back(time_of(least, stage.json_name));
    const double least_yardstick = time_of(json, "yardstick_ms");
    row.samples.yardstick = {least_yardstick};
    if (has_samples) {
        for (const SampleKind& kind : kSampleKinds)
            row.samples.*kind.samples = samples_of(json, kind);
    }
    if (least_yardstick <= 0 || std::ranges::min(row.samples.yardstick) <= 0)
        refuse("has a yardstick_ms that is not above 0");
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
    report.has_samples = json.find("waited").has_value();
    if (report.has_samples) {
        report.waited = part_of(json, "waited");
        report.others = part_of(json, "others");
    }
    for (std::size_t i = 0; i < frames.size(); ++i)
        report.rows.push_back(row_of(frames[i], report.has_samples));
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

/// The times of a stage of the baseline at the frame of `now`, in ms of this run's yardstick. Where
/// the baseline has the least time alone, they are this run's times, scaled to that least one.
std::vector<double> expected_samples(const Stage& stage, const ProfileRow& then,
                                     const ProfileRow& now, bool has_samples) {
    const auto least = [](const std::vector<double>& times) { return std::ranges::min(times); };
    const std::vector<double>& before = then.samples.*stage.samples;
    const std::vector<double>& source = has_samples ? before : now.samples.*stage.samples;
    const double factor = has_samples
                              ? median(now.samples.yardstick) / median(then.samples.yardstick)
                              : least(before) / std::max(least(source), kLeastMs) *
                                    least(now.samples.yardstick) / least(then.samples.yardstick);
    std::vector<double> expected;
    for (const double ms : source) expected.push_back(std::max(kLeastMs, factor * ms));
    return expected;
}

/// A stage at one frame in both runs.
struct FrameChange {
    double frame;
    double expected_ms;
    double measured_ms;
    double ratio;
};

/// Changes that neither run can tell from noise.
struct Margins {
    /// The ratio of two times of the same work that other programs may cause, in either direction;
    /// 1 on an idle machine.
    double load = 1;
    /// As above, or the middle half of the yardstick's times, of largest to least, if that is more.
    double noise = 1;
};

/// Where other programs took a part w of the machine, or threads did not run for a part w of the
/// time, 1 - w was left. So a stage takes up to 1 / (1 - w) times as long as on an idle machine,
/// and so does the yardstick that it is compared with, in other moments.
Margins margins_of(const ProfileReport& report) {
    std::vector<double> yardsticks;
    for (const ProfileRow& row : report.rows)
        yardsticks.insert(yardsticks.end(), row.samples.yardstick.begin(),
                          row.samples.yardstick.end());
    std::ranges::sort(yardsticks);
    const double taken = std::min(std::max(report.waited, report.others), kMostTaken);
    const double load = taken < kIdleTaken ? 1 : 1 / ((1 - taken) * (1 - taken));
    return {load, std::max(load, quantile(yardsticks, 0.75) / quantile(yardsticks, 0.25))};
}

/// A stage with the chances that noise makes it slower, or faster, by more than the margin.
struct Measured {
    StageChange change;
    double chance_slower = 1;
    double chance_faster = 1;
    /// The least that both can be with as many runs.
    double least_chance = 1;
    /// The frames that are compared, and the runs of each on both sides.
    std::size_t frames = 0;
    std::size_t runs_before = 0;
    std::size_t runs_after = 0;
};

Measured measured(const Stage& stage, const std::string& backend, const ProfileReport& baseline,
                  const ProfileReport& report, double margin, double confidence) {
    std::vector<FrameChange> changes;
    std::vector<Stratum> strata, slower, faster;
    const auto scaled = [](std::vector<double> values, double factor) {
        for (double& value : values) value *= factor;
        return values;
    };
    for (const ProfileRow& now : report.rows) {
        if (now.backend != backend) continue;
        const ProfileRow& then = *find_row(baseline, now.frame, backend);
        Stratum stratum{expected_samples(stage, then, now, baseline.has_samples), {}};
        for (const double ms : now.samples.*stage.samples)
            stratum.after.push_back(std::max(kLeastMs, ms));
        const double expected = median(stratum.before);
        const double taken = median(stratum.after);
        changes.push_back({now.frame, expected, taken, taken / expected});
        slower.push_back({scaled(stratum.before, margin), stratum.after});
        faster.push_back({scaled(stratum.after, margin), stratum.before});
        strata.push_back(std::move(stratum));
    }
    std::ranges::stable_sort(changes, {}, &FrameChange::ratio);
    // As in the ratio, the geometric mean of the two frames in the middle of an even number.
    const FrameChange& lower = changes[(changes.size() - 1) / 2];
    const FrameChange& upper = changes[changes.size() / 2];
    const FrameChange& worst = changes.back();
    return {{.backend = backend,
             .stage = stage.name,
             .expected_ms = std::sqrt(lower.expected_ms * upper.expected_ms),
             .measured_ms = std::sqrt(lower.measured_ms * upper.measured_ms),
             .ratio = ratio_of_medians(strata, confidence),
             .worst_frame = worst.frame,
             .worst_percent = 100 * (worst.ratio - 1)},
            chance_of_rise(slower),
            chance_of_rise(faster),
            least_chance(strata),
            strata.size(),
            strata.front().before.size(),
            strata.front().after.size()};
}

/// `limit` is the ratio that a stage may reach.
StageVerdict verdict_of(const StageChange& change, const Margins& margins, double limit,
                        double chance_slower, double chance_faster) {
    if (std::max(change.expected_ms, change.measured_ms) < kShortestMs)
        return StageVerdict::kTooShort;
    const RatioInterval& ratio = change.ratio;
    const double clear = std::max(limit, margins.noise);
    if (chance_slower < kMostChance && ratio.ratio > clear && ratio.least > margins.load)
        return StageVerdict::kSlower;
    if (chance_faster < kMostChance && ratio.ratio < 1 / clear && ratio.most < 1 / margins.load)
        return StageVerdict::kFaster;
    return ratio.most * margins.load <= limit ? StageVerdict::kSame : StageVerdict::kUnsure;
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
    BaselineReport result{.file = file,
                          .version = baseline.version,
                          .tolerance_percent = tolerance_percent,
                          .has_samples = baseline.has_samples,
                          .confidence = kConfidence,
                          .stages = {}};
    std::vector<std::string> backends;
    for (const ProfileRow& row : report.rows) {
        if (std::ranges::find(backends, row.backend) == backends.end())
            backends.push_back(row.backend);
    }
    Margins margins = margins_of(report);
    if (baseline.has_samples) {
        const Margins then = margins_of(baseline);
        margins.load = std::max(margins.load, then.load);
        margins.noise = std::max(margins.noise, then.noise);
    }
    result.load_factor = margins.load;
    const auto stages = static_cast<double>(backends.size() * kStages.size());
    std::vector<double> slower, faster;
    for (const std::string& backend : backends) {
        for (const Stage& stage : kStages) {
            const Measured now = measured(stage, backend, baseline, report, margins.noise,
                                          1 - (1 - kConfidence) / stages);
            result.stages.push_back(now.change);
            slower.push_back(now.chance_slower);
            faster.push_back(now.chance_faster);
            result.has_too_few_runs = stages * now.least_chance >= kMostChance;
            result.runs = now.runs_after;
            result.baseline_runs = now.runs_before;
            result.least_runs = least_values(now.frames, kMostChance / stages);
        }
    }
    slower = corrected_chances(slower);
    faster = corrected_chances(faster);
    for (std::size_t i = 0; i < result.stages.size(); ++i) {
        StageChange& stage = result.stages[i];
        stage.chance = stage.ratio.ratio >= 1 ? slower[i] : faster[i];
        stage.verdict =
            verdict_of(stage, margins, 1 + tolerance_percent / 100, slower[i], faster[i]);
    }
    return result;
}

}  // namespace mray::app
