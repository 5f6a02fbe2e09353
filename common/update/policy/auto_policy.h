// The policy that compares the costs of a degraded tree with those of a new one.
#pragma once

#include <array>

#include "common/update/policy/loss_account.h"
#include "common/update/policy/slowdown_model.h"
#include "common/update/policy/update_policy.h"

namespace mray {

/// Refits; restructures degraded parts and rebuilds when that pays. There are two cases:
///
/// - A remedy *pays at once* if this frame alone would lose its price. It is applied in the frame.
/// - Otherwise it is an investment in frames that may never come. It has to be due (LossAccount,
///   one for each remedy), and the *purse* has to hold its price. A part (5 %) of the time of all
///   frames goes into the purse, and what earlier remedies have saved. So a clip of any length
///   loses little to foresight that was wrong, and a remedy that helps pays for the next one.
///
/// An investment adds at most the budget to a frame: a restructuring is cut to it, a build that
/// takes more runs in the background while refitted frames are shown.
///
/// Losses are not measured by times, which change with the image. They are the slow-down that the
/// excess visits of the tree explain (SlowdownModel), in units of the time of a sound tree.
class AutoPolicy final : public UpdatePolicy {
public:
    explicit AutoPolicy(const UpdateConfig& config)
        : config_(config), model_(config.first_per_visit) {}

    UpdateDecision plan() override;
    UpdateDecision review(const RefittedTree& tree) override;
    bool needs_tree_cost() const override { return true; }
    bool may_restructure() const override { return true; }
    void built(double cost) override { build_cost_ = measured_build_cost_ = cost; }
    void frame_done(const FrameCost& cost) override;

private:
    /// The loss of a frame by a tree with this excess, in traces of a sound tree.
    double loss(double excess) const;
    /// The part of the loss that only a build can cure.
    double residual(double excess) const;
    /// Costs in the same unit.
    double build_price() const { return traces_ > 0 ? build_cost_ / sound_trace_ : 1; }
    double restructure_price() const { return restructure_cost() / sound_trace_; }
    double restructure_cost() const;
    /// The time that an investment may add to refit and trace of a frame.
    double budget() const;
    /// The number of frames that a background build is assumed to take.
    double build_frames() const;
    bool should_restructure(double excess) const;
    void judge_restructuring(double excess);
    UpdateDecision rebuild_when_due(const RefittedTree& tree) const;
    std::string facts(double excess) const;
    void balance_purse(const FrameCost& cost);
    void remember_trace(double sound_trace);

    UpdateConfig config_;
    SlowdownModel model_;
    LossAccount builds_;
    LossAccount restructurings_;
    /// Time that may be spent on investments; below 0 after a remedy that has not yet paid.
    double purse_ = 0;
    double build_cost_ = 0;
    double measured_build_cost_ = 0;
    /// 0 before the first.
    double restructure_cost_ = 0;
    /// The median of the last traces, each divided by its slow-down; 0, which makes all prices
    /// infinite, where nothing is traced. Before the end of the first frame a build is taken to
    /// cost a sound trace, and nothing is restructured.
    double sound_trace_ = 0;
    std::array<double, 5> last_traces_ = {};
    std::size_t traces_ = 0;
    /// Refit and trace of the last frame.
    double frame_cost_ = 0;
    /// Time and excess of the last trace that no background build disturbed.
    double trace_ = 0;
    double excess_ = 0;
    /// The excess right after the last build or restructuring, which that could not cure.
    double floor_ = 0;
    /// The excess at the decision for the restructuring that is judged next.
    double asked_excess_ = 0;
    /// Frames to wait after a restructuring that did not help; it doubles each time.
    int backoff_ = 0;
    int wait_ = 0;
};

}  // namespace mray
