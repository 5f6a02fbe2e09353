// The policy that weighs what a rotten tree costs against a new one.
#pragma once

#include <array>

#include "common/slowdown_model.h"
#include "common/update_policy.h"

namespace morphray {

/// Refits, and rebuilds when that pays. In each frame a tree loses what tracing it takes more than
/// tracing a sound one. With losses x_1 ... x_K since a build that costs B, two rules:
///
/// - *Due*: K x_K - (x_1 + ... + x_K) >= B. If the next tree rots like this one did, the mean cost
///   of a frame, (B + x_1 + ... + x_K) / K, is least where the loss has grown to that mean (the
///   economic life of equipment: G. Taylor. A statistical theory of depreciation. 1923). A loss
///   that was there at once and does not grow is never due: a new tree would soon be as bad.
/// - *Overdue*: x_1 + ... + x_K >= B. In case the next tree does not rot like this one: whatever
///   comes, this pays at most twice what hindsight would (ski rental: R. Karp. On-line algorithms
///   versus off-line algorithms. 1992).
///
/// For losses that grow evenly both say the same. A build that has not saved half its cost by the
/// time of the next one doubles the patience, the factor before B; one that has halves it, down to
/// 1. That, and the memory of all losses since the build, is the hysteresis.
///
/// A frame that would lose more than a build by itself is a *jump* and gets its tree at once. Other
/// builds that would take more than the budget go on behind while refitted frames are shown.
///
/// Losses are not seen in times, which change with the picture. They are what the cost ratio
/// explains (SlowdownModel), in units of the time that a sound tree would take.
class AutoPolicy final : public UpdatePolicy {
public:
    explicit AutoPolicy(const UpdateConfig& config) : config_(config) {}

    UpdateDecision plan() override;
    UpdateDecision review(const RefittedTree& tree) override;
    bool needs_cost_ratio() const override { return true; }
    void built(double cost) override { build_cost_ = cost; }
    void frame_done(const FrameCost& cost) override;

private:
    /// What a frame loses to a tree of this ratio, in traces of a sound one.
    double loss(double cost_ratio) const;
    /// A build's cost in the same unit.
    double price() const { return build_cost_ / sound_trace_; }
    void remember_trace(double sound_trace);
    void start_over();

    UpdateConfig config_;
    SlowdownModel model_;
    double build_cost_ = 0;
    /// The median of the last traces, each as if of a sound tree; 0 before the first, which makes
    /// builds infinitely dear.
    double sound_trace_ = 0;
    std::array<double, 5> last_traces_ = {};
    std::size_t traces_ = 0;
    /// Of the last frame: refit and trace.
    double frame_cost_ = 0;
    /// Of the last frame that no build behind disturbed.
    double trace_ = 0;
    double cost_ratio_ = 1;
    /// Since the tree's build.
    double frames_ = 0;
    double lost_ = 0;
    double last_loss_ = 0;
    /// What a frame lost before this tree, and what this tree has saved by that measure.
    double loss_before_ = 0;
    double saved_ = 0;
    double patience_ = 1;
};

}  // namespace morphray
