// The policy that compares the costs of a degraded tree with those of a new one.
#pragma once

#include <array>

#include "common/update/policy/loss_account.h"
#include "common/update/policy/slowdown_model.h"
#include "common/update/policy/update_policy.h"

namespace mray {

/// Refits; restructures degraded parts when that pays; and rebuilds when the losses that
/// restructuring cannot cure have cost a build (LossAccount, one for each remedy). A frame that
/// would lose more than the price of a remedy by itself is a *jump* and gets the remedy at once.
/// Other builds that take more than the budget run in the background while refitted frames are
/// shown.
///
/// A frame that would lose more than a fifth (kMostLoss) gets a remedy in any case. A background
/// build starts early enough to end before such a frame, as far as the degradation of the last
/// frame predicts it.
///
/// Losses are not measured by times, which change with the image. They are the slow-down that the
/// cost ratio explains (SlowdownModel), in units of the time of a sound tree.
class AutoPolicy final : public UpdatePolicy {
public:
    explicit AutoPolicy(const UpdateConfig& config)
        : config_(config), model_(config.first_exponent) {}

    UpdateDecision plan() override;
    UpdateDecision review(const RefittedTree& tree) override;
    bool needs_cost_ratio() const override { return true; }
    bool may_restructure() const override { return true; }
    void built(double cost) override { build_cost_ = measured_build_cost_ = cost; }
    void frame_done(const FrameCost& cost) override;

private:
    /// The loss of a frame by a tree of this ratio, in traces of a sound tree.
    double loss(double cost_ratio) const;
    /// The part of the loss that only a build can cure.
    double residual(double cost_ratio) const;
    /// Costs in the same unit.
    double build_price() const { return build_cost_ / sound_trace_; }
    double restructure_price() const { return restructure_cost() / sound_trace_; }
    double restructure_cost() const;
    /// The time that a build may add to refit and trace of a frame.
    double budget() const;
    /// The number of frames that a background build is assumed to take.
    double build_frames() const;
    bool restructuring_is_due(double cost_ratio) const;
    void judge_restructuring(double cost_ratio);
    UpdateDecision rebuild_when_due(const RefittedTree& tree) const;
    /// Whether a build that starts now would end too late, or only just in time, to keep frames
    /// below kMostLoss.
    bool will_lose_most(double cost_ratio) const;
    std::string facts(double cost_ratio) const;
    void remember_trace(double sound_trace);

    UpdateConfig config_;
    SlowdownModel model_;
    LossAccount builds_;
    LossAccount restructurings_;
    double build_cost_ = 0;
    double measured_build_cost_ = 0;
    /// 0 before the first.
    double restructure_cost_ = 0;
    /// The median of the last traces, each divided by its slow-down; 0 before the first trace,
    /// which makes all prices infinite.
    double sound_trace_ = 0;
    std::array<double, 5> last_traces_ = {};
    std::size_t traces_ = 0;
    /// Refit and trace of the last frame.
    double frame_cost_ = 0;
    /// Time and cost ratio of the last trace that no background build disturbed.
    double trace_ = 0;
    double cost_ratio_ = 1;
    /// The cost ratio of the last frame.
    double last_ratio_ = 1;
    /// The cost ratio of the tree in its first frame; above 1 if it was built in the background.
    double first_ratio_ = 1;
    /// The cost ratio right after the last build or restructuring, which that could not cure.
    double floor_ratio_ = 1;
    /// The cost ratio at the decision for the restructuring that is judged next.
    double asked_ratio_ = 1;
    /// Frames to wait after a restructuring that did not help; it doubles each time.
    int backoff_ = 0;
    int wait_ = 0;
};

}  // namespace mray
