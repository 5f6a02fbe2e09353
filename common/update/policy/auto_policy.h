// The policy that weighs what a degraded tree costs against a new one.
#pragma once

#include <array>

#include "common/update/policy/loss_account.h"
#include "common/update/policy/slowdown_model.h"
#include "common/update/policy/update_policy.h"

namespace morphray {

/// Refits, restructures what is degraded when that pays, and rebuilds when what restructuring
/// cannot cure has cost a build (LossAccount, one for each remedy). A frame that would lose more
/// than a remedy's price by itself is a *jump* and gets it at once. Other builds that would take
/// more than the budget run in the background while refitted frames are shown.
///
/// Whatever the accounts say, a frame that would lose more than a fifth (kMostLoss) gets a remedy,
/// and a build in the background begins so early that its tree is there before such a frame, as far
/// as the last frame's degradation tells.
///
/// Losses are not seen in times, which change with the image. They are what the cost ratio
/// explains (SlowdownModel), in units of the time that a sound tree would take.
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
    /// What a frame loses to a tree of this ratio, in traces of a sound one.
    double loss(double cost_ratio) const;
    /// The part of it that only a build can cure.
    double residual(double cost_ratio) const;
    /// Costs in the same unit.
    double build_price() const { return build_cost_ / sound_trace_; }
    double restructure_price() const { return restructure_cost() / sound_trace_; }
    double restructure_cost() const;
    /// Refit and trace of a frame may take so much longer for a build.
    double budget() const;
    /// The frames that a build in the background is taken to last.
    double build_frames() const;
    bool restructuring_is_due(double cost_ratio) const;
    void judge_restructuring(double cost_ratio);
    UpdateDecision rebuild_when_due(const RefittedTree& tree) const;
    /// Whether a tree that is begun now will be there too late to keep frames below kMostLoss, or
    /// only just in time.
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
    /// The median of the last traces, each as if of a sound tree; 0 before the first, which makes
    /// everything infinitely dear.
    double sound_trace_ = 0;
    std::array<double, 5> last_traces_ = {};
    std::size_t traces_ = 0;
    /// Of the last frame: refit and trace.
    double frame_cost_ = 0;
    /// Of the last frame that no build in the background disturbed.
    double trace_ = 0;
    double cost_ratio_ = 1;
    /// Of the last frame.
    double last_ratio_ = 1;
    /// Of the tree in use, in its first frame; above 1 if it was built in the background.
    double first_ratio_ = 1;
    /// Right after the last build or restructuring: what that could not cure.
    double floor_ratio_ = 1;
    /// When the restructuring was decided that is to be judged next.
    double asked_ratio_ = 1;
    /// After restructurings that did not help: frames to wait, each time twice as long.
    int backoff_ = 0;
    int wait_ = 0;
};

}  // namespace morphray
