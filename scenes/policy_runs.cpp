#include "scenes/policy_runs.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "common/base/stopwatch.h"
#include "common/report/spread.h"
#include "common/text/number_text.h"
#include "common/update/tree_updater.h"

namespace mray {
namespace {

// Costs of a tree that is older than kOldest frames are measured for the first tree only, in at
// most kMostCostRounds rounds: r rounds of n frames take some n * kOldest * r traces.
constexpr std::size_t kOldest = 32;
constexpr int kMostCostRounds = 3;

int cost_rounds(int repeat) { return std::min(repeat, kMostCostRounds); }

std::size_t ages(std::size_t frames, std::size_t built_at) {
    return std::min(frames - built_at, kOldest);
}

/// The frames of the last round, each with the times of the round with its median cost.
std::vector<PolicyFrame> merge_rounds(const std::vector<std::vector<PolicyFrame>>& rounds) {
    std::vector<PolicyFrame> merged = rounds.back();
    for (std::size_t f = 0; f < merged.size(); ++f) {
        std::vector<PolicyFrame> played;
        for (const auto& round : rounds) {
            played.push_back(round[f]);
            merged[f].traces_ms.push_back(round[f].times.trace_ms);
            merged[f].costs_ms.push_back(round[f].cost_ms());
        }
        merged[f].times =
            lower_median(played, [](const PolicyFrame& frame) { return frame.cost_ms(); }).times;
    }
    return merged;
}

double total_of(const std::vector<PolicyFrame>& frames) {
    double total = 0;
    for (const PolicyFrame& frame : frames) total += frame.cost_ms();
    return total;
}

std::string fixed_ms(double value) { return fmt::format("{:.3f}", value); }

}  // namespace

double PolicyRun::total_ms() const { return total_of(frames); }

double PolicyRun::median_frame_ms() const {
    std::vector<double> values;
    for (const PolicyFrame& frame : frames) values.push_back(frame.cost_ms());
    return lower_median(values);
}

double PolicyRun::worst_frame_ms() const {
    double worst = 0;
    for (const PolicyFrame& frame : frames) worst = std::max(worst, frame.cost_ms());
    return worst;
}

double PolicyRun::worst_trace_vs_rebuilt() const {
    double worst = 0;
    for (const PolicyFrame& frame : frames)
        worst = std::max(worst, frame.times.trace_ms / frame.trace_rebuilt_ms);
    return worst;
}

std::size_t PolicyRun::rebuilds() const {
    return static_cast<std::size_t>(
        std::count_if(frames.begin(), frames.end(), [](const PolicyFrame& frame) {
            return frame.update == name_of(TreeStep::kRebuilt) ||
                   frame.update == name_of(TreeStep::kSwapped);
        }));
}

std::string PolicyComparison::best_policy() const {
    double least = best.total;
    std::string policy;
    for (const PolicyRun& run : runs) {
        if (run.total_ms() >= least) continue;
        least = run.total_ms();
        policy = run.policy;
    }
    return policy;
}

PolicyRunner::PolicyRunner(SceneFrames& scene, const std::vector<double>& frames,
                           const ViewSpec& view, const RunConfig& config, int repeat,
                           std::unique_ptr<Backend> backend)
    : scene_(scene),
      frames_(frames),
      view_(view),
      config_(config),
      repeat_(repeat),
      backend_(std::move(backend)) {}

std::size_t PolicyRunner::expected_frames(std::size_t policies) const {
    std::size_t traces = frames_.size();
    for (std::size_t b = 0; b < frames_.size(); ++b) traces += ages(frames_.size(), b);
    return traces * static_cast<std::size_t>(cost_rounds(repeat_)) +
           policies * frames_.size() * static_cast<std::size_t>(repeat_);
}

/// Traces the backend's frame; returns milliseconds.
double PolicyRunner::measure(const std::function<void()>& on_frame) {
    on_frame();
    backend_->trace_image(scene_.image_params(view_), image_);
    return backend_->finish().trace_ms;
}

std::vector<PolicyFrame> PolicyRunner::play(const PolicySpec& policy,
                                            const std::function<void()>& on_frame) {
    UpdateConfig config = config_.update;
    config.record_cost_ratio = true;
    const double build_at = config_.build_at.value_or(frames_.front());
    TreeUpdater updater(scene_.clip().topology(), scene_.positions(build_at), *backend_, nullptr,
                        policy, config_.build, config);
    // The first trace of a scene is slower than all others.
    backend_->trace_image(scene_.image_params(view_), image_);
    std::vector<PolicyFrame> played;
    for (const double number : frames_) {
        PolicyFrame& frame = played.emplace_back();
        frame.frame = number;
        const std::span<const vec3> positions = scene_.positions(number);
        const bool first = played.size() == 1 && number == build_at;
        if (!first) updater.update(positions);
        frame.times.deform_ms = scene_.deform_ms();
        frame.times.trace_ms = measure(on_frame);
        frame.times.rays = backend_->finish().rays;
        updater.frame_done({.ms = frame.times.trace_ms, .rays = frame.times.rays});
        const TreeUpdate& update = updater.last();
        if (!first) frame.times.update = update.times;
        frame.update = name_of(update.step);
        frame.reason = update.reason;
        frame.cost_ratio = update.cost_ratio;
        frame.build_pending = update.build_pending;
        frame.hits_hash = hits_hash(image_);
    }
    return played;
}

ScheduleCosts PolicyRunner::measure_costs(const std::function<void()>& on_frame) {
    const std::size_t count = frames_.size();
    const Topology& topology = scene_.clip().topology();
    const auto refit_and_trace = [&](std::size_t frame) {
        backend_->refit(scene_.positions(frames_[frame]));
        const double update = backend_->finish().update.total_ms();
        return update + measure(on_frame);
    };
    ScheduleCosts costs;
    const double build_at = config_.build_at.value_or(frames_.front());
    const std::span<const vec3> start = scene_.positions(build_at);
    backend_->set_scene(topology, start, build_bvh(topology, start, config_.build));
    for (std::size_t f = 0; f < count; ++f) costs.first.push_back(refit_and_trace(f));
    trace_rebuilt_ms_.resize(count);
    for (std::size_t b = 0; b < count; ++b) {
        const std::span<const vec3> positions = scene_.positions(frames_[b]);
        const Stopwatch watch;
        const Bvh bvh = build_bvh(topology, positions, config_.build);
        double update = watch.ms();
        backend_->set_frame(positions, bvh);
        update += backend_->finish().update.upload_ms;
        trace_rebuilt_ms_[b] = measure(on_frame);
        costs.built.push_back({update + trace_rebuilt_ms_[b]});
        for (std::size_t age = 1; age < ages(count, b); ++age)
            costs.built[b].push_back(refit_and_trace(b + age));
    }
    return costs;
}

PolicyComparison PolicyRunner::compare(std::span<const PolicySpec> policies,
                                       const std::function<void()>& on_frame) {
    std::vector<std::vector<std::vector<PolicyFrame>>> rounds(policies.size());
    std::vector<ScheduleCosts> costs;
    std::vector<std::vector<double>> traces;
    for (int round = 0; round < repeat_; ++round) {
        for (std::size_t p = 0; p < policies.size(); ++p)
            rounds[p].push_back(play(policies[p], on_frame));
        if (round >= cost_rounds(repeat_)) continue;
        costs.push_back(measure_costs(on_frame));
        traces.push_back(trace_rebuilt_ms_);
    }
    PolicyComparison result;
    const auto median_over_rounds = [&costs](auto entry) {
        std::vector<double> values;
        for (const ScheduleCosts& c : costs) values.push_back(entry(c));
        return lower_median(values);
    };
    result.costs = costs.front();
    for (std::size_t f = 0; f < frames_.size(); ++f) {
        result.costs.first[f] =
            median_over_rounds([&](const ScheduleCosts& c) { return c.first[f]; });
        for (std::size_t age = 0; age < result.costs.built[f].size(); ++age) {
            result.costs.built[f][age] =
                median_over_rounds([&](const ScheduleCosts& c) { return c.built[f][age]; });
        }
        std::vector<double> values;
        for (const std::vector<double>& round : traces) values.push_back(round[f]);
        trace_rebuilt_ms_[f] = lower_median(values);
    }
    result.best = best_schedule(result.costs);
    for (std::size_t p = 0; p < policies.size(); ++p) {
        PolicyRun& run = result.runs.emplace_back();
        run.policy = text_of(policies[p]);
        run.backend = backend_->info().name;
        run.frames = merge_rounds(rounds[p]);
        for (const auto& round : rounds[p]) run.totals_ms.push_back(total_of(round));
        for (std::size_t f = 0; f < frames_.size(); ++f)
            run.frames[f].trace_rebuilt_ms = trace_rebuilt_ms_[f];
    }
    double best_ms = result.best.total;
    for (const PolicyRun& run : result.runs) best_ms = std::min(best_ms, run.total_ms());
    for (PolicyRun& run : result.runs) run.best_ms = best_ms;
    return result;
}

Table policy_frames_table(std::span<const PolicyComparison> comparisons) {
    Table table({"policy", "backend", "frame", "update", "upload ms", "refit ms", "decide ms",
                 "restructure ms", "rebuild ms", "trace ms", "rebuilt trace ms", "cost ratio",
                 "hits hash", "reason", "least trace ms", "trace spread %", "least cost ms",
                 "median cost ms", "cost spread %"});
    for (const PolicyComparison& comparison : comparisons) {
        for (const PolicyRun& run : comparison.runs) {
            for (const PolicyFrame& f : run.frames) {
                const UpdateTimes& update = f.times.update;
                const Spread trace = spread_of(f.traces_ms);
                const Spread cost = spread_of(f.costs_ms);
                table.add({run.policy, run.backend, fmt::format("{}", f.frame), f.update,
                           fixed_ms(update.upload_ms), fixed_ms(update.refit_ms),
                           fixed_ms(update.decide_ms), fixed_ms(update.restructure_ms),
                           fixed_ms(update.rebuild_ms), fixed_ms(f.times.trace_ms),
                           fixed_ms(f.trace_rebuilt_ms), fmt::format("{:.4f}", f.cost_ratio),
                           hash_text(f.hits_hash), f.reason, fixed_ms(trace.least),
                           fmt::format("{:.1f}", trace.percent), fixed_ms(cost.least),
                           fixed_ms(cost.median), fmt::format("{:.1f}", cost.percent)});
            }
        }
    }
    return table;
}

std::vector<plot::Panel> policy_panels(std::span<const PolicyComparison> comparisons,
                                       const std::string& frames) {
    std::vector<plot::Panel> panels;
    for (const PolicyComparison& comparison : comparisons) {
        const std::string backend = comparison.runs.front().backend;
        plot::Panel panel{.kind = "lines",
                          .x = "frame",
                          .series = "policy",
                          .xlabel = frames,
                          .where = "backend",
                          .is = backend};
        const auto add = [&](const char* title, const char* y, const char* unit,
                             const char* least) {
            panel.title = fmt::format("{}, {}", title, backend);
            panel.y = y;
            panel.ylabel = unit;
            panel.least = least;
            panels.push_back(panel);
        };
        add("trace", "trace ms", "ms", "least trace ms");
        add("quality of the tree", "cost ratio", "SAH cost / SAH cost at its build", "");
        add("update and trace", "median cost ms", "ms", "least cost ms");
    }
    return panels;
}

}  // namespace mray
