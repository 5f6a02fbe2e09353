// The policy that weighs what a rotten tree costs against a new one.
#pragma once

#include "common/slowdown_model.h"
#include "common/update_policy.h"

namespace morphray {

/// Refits, and keeps account of what the tree's rot has cost in tracing since its build: its debt.
/// Once that is what a build costs, a build is worth it. For a slow-down that grows evenly this is
/// the best schedule there is (build cost B, excess r k in the k-th frame: the mean B / K + r K / 2
/// is least where r K^2 / 2 = B), and for any other it pays at most twice what hindsight would (the
/// ski rental problem: R. Karp. On-line algorithms versus off-line algorithms. 1992).
///
/// Excess is not seen in times alone, which change with the picture; it is the part of a frame's
/// trace time that the cost ratio explains (SlowdownModel), so a tree that has not rotted owes
/// nothing however long it is traced, and builds that turn out not to help become rare.
///
/// A frame whose own excess would be more than a build is a jump and gets its tree at once. Else a
/// build that would take more than the budget goes on behind while refitted frames are shown.
class AutoPolicy final : public UpdatePolicy {
public:
    explicit AutoPolicy(const UpdateConfig& config) : config_(config) {}

    UpdateDecision plan() override;
    UpdateDecision review(const RefittedTree& tree) override;
    bool needs_cost_ratio() const override { return true; }
    void built(double cost) override { build_cost_ = cost; }
    void frame_done(const FrameCost& cost) override;

private:
    /// What tracing a tree of this ratio is going to cost.
    double expected_trace(double cost_ratio) const;
    /// The part of a trace that rot is to blame for.
    double excess(double trace, double cost_ratio) const;

    UpdateConfig config_;
    SlowdownModel model_;
    double build_cost_ = 0;
    double debt_ = 0;
    /// Of the last frame that was not disturbed by a build behind.
    double trace_ = 0;
    double cost_ratio_ = 1;
    /// Of the last frame: refit and trace.
    double frame_cost_ = 0;
};

}  // namespace morphray
