// A clip under several update policies, and the best schedule in hindsight.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/backend.h"
#include "common/frame_times.h"
#include "common/report/plot.h"
#include "common/report/table.h"
#include "common/update/tree_updater.h"
#include "scenes/scene_frames.h"
#include "scenes/schedule.h"

namespace mray {

struct PolicyFrame {
    double frame = 0;
    /// The step and its reason in the last round.
    std::string update;
    std::string reason;
    double cost_ratio = 1;
    bool build_pending = false;
    std::uint64_t hits_hash = 0;
    /// The times of the round with the median cost_ms().
    FrameTimes times;
    /// trace_ms and cost_ms() of each round.
    std::vector<double> traces_ms;
    std::vector<double> costs_ms;
    /// Time to trace the tree that is built at this frame.
    double trace_rebuilt_ms = 0;

    double cost_ms() const { return times.update.total_ms() + times.trace_ms; }
};

/// How a runner builds and updates trees.
struct RunConfig {
    UpdateConfig update;
    BuildConfig build;
    /// The frame whose positions the first tree is built at; none: the first frame.
    std::optional<double> build_at;
};

/// One policy on one backend. Its costs leave out the first build and deforming.
struct PolicyRun {
    std::string policy;
    std::string backend;
    std::vector<PolicyFrame> frames;
    /// The costs of all frames of each round added up.
    std::vector<double> totals_ms;
    /// The least that is known to be possible on the same backend: total_ms() of the best schedule
    /// of refits and rebuilds, or of the best policy if that took less.
    double best_ms = 0;

    double total_ms() const;
    double median_frame_ms() const;
    double worst_frame_ms() const;
    double worst_trace_vs_rebuilt() const;
    /// The cost beyond best_ms, relative to it. Never negative, because best_ms is at most
    /// total_ms().
    double regret() const { return best_ms > 0 ? total_ms() / best_ms - 1 : 0; }
    /// Trees built after the first.
    std::size_t rebuilds() const;
};

/// All policies on one backend.
struct PolicyComparison {
    std::vector<PolicyRun> runs;
    ScheduleCosts costs;
    Schedule best;

    /// The policy whose total is PolicyRun::best_ms; empty if that is the best schedule's.
    std::string best_policy() const;
};

/// One row per frame of each policy and backend.
Table policy_frames_table(std::span<const PolicyComparison> comparisons);

/// Three panels for each backend, which compare policies by frame: trace, quality of the tree,
/// update and trace. They show policy_frames_table(); `frames` is the title of the axis of frames.
std::vector<plot::Panel> policy_panels(std::span<const PolicyComparison> comparisons,
                                       const std::string& frames);

/// Measures policies on one backend. They take turns clip by clip, not frame by frame, so that a
/// background build slows down only the frames of its own policy.
class PolicyRunner {
public:
    /// Plays `repeat` rounds of the clip for each policy. Scene and
    /// frames (at least one) must outlive the runner.
    PolicyRunner(SceneFrames& scene, const std::vector<double>& frames, const ViewSpec& view,
                 const RunConfig& config, int repeat, std::unique_ptr<Backend> backend);

    /// Measures the policies and the costs of schedules. Calls `on_frame` before each traced frame,
    /// expected_frames() times; it may throw to end the work.
    PolicyComparison compare(std::span<const PolicySpec> policies,
                             const std::function<void()>& on_frame);
    std::size_t expected_frames(std::size_t policies) const;

private:
    std::vector<PolicyFrame> play(const PolicySpec& policy, const std::function<void()>& on_frame);
    ScheduleCosts measure_costs(const std::function<void()>& on_frame);
    double measure(const std::function<void()>& on_frame);

    SceneFrames& scene_;
    const std::vector<double>& frames_;
    ViewSpec view_;
    RunConfig config_;
    int repeat_;
    std::unique_ptr<Backend> backend_;
    /// PolicyFrame::trace_rebuilt_ms of each frame.
    std::vector<double> trace_rebuilt_ms_;
    Frame image_;
};

}  // namespace mray
