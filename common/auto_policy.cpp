#include "common/auto_policy.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace morphray {
namespace {

// Up to here a tree counts as good: the ratio itself is no more exact than that (a tree built for
// the frame is within 5 % of the refitted one's cost either way on waves and cloth).
constexpr double kSound = 1.05;

// Whatever the budget: a tree that is older when it is shown is no better than the one before.
constexpr double kMostBuildFrames = 64;

}  // namespace

double AutoPolicy::expected_trace(double cost_ratio) const {
    return trace_ * model_.slowdown(cost_ratio) / model_.slowdown(cost_ratio_);
}

double AutoPolicy::excess(double trace, double cost_ratio) const {
    return cost_ratio <= kSound ? 0 : trace * (1 - 1 / model_.slowdown(cost_ratio));
}

UpdateDecision AutoPolicy::plan() { return {UpdateStep::kRefit, "a refit comes first"}; }

UpdateDecision AutoPolicy::review(const RefittedTree& tree) {
    if (std::isinf(tree.cost_ratio)) {
        return {UpdateStep::kRebuild, "the tree was built for a scene without extent"};
    }
    if (tree.cost_ratio <= kSound) {
        return {UpdateStep::kRefit, fmt::format("cost ratio {:.2f}: sound", tree.cost_ratio)};
    }
    const double loss = excess(expected_trace(tree.cost_ratio), tree.cost_ratio);
    const std::string facts = fmt::format("cost ratio {:.2f}, debt {:.2f} + {:.2f} of {:.2f}",
                                          tree.cost_ratio, debt_, loss, build_cost_);
    if (loss > build_cost_) return {UpdateStep::kRebuild, "a jump: " + facts};
    if (tree.build_pending) return {UpdateStep::kRefit, "a build goes on behind: " + facts};
    // Half of the frame to come: see the derivation above, for whole frames.
    if (debt_ + loss / 2 < build_cost_) return {UpdateStep::kRefit, "not yet due: " + facts};
    const double share = config_.budget_ms > 0 ? config_.budget_ms : config_.budget * frame_cost_;
    if (build_cost_ <= share) return {UpdateStep::kRebuild, "due: " + facts};
    const double frames = std::min(std::ceil(build_cost_ / share), kMostBuildFrames);
    return {UpdateStep::kRebuildBehind, "due, and over the budget: " + facts,
            static_cast<std::uint32_t>(frames)};
}

void AutoPolicy::frame_done(const FrameCost& cost) {
    if (cost.rebuild > 0) build_cost_ = cost.rebuild;
    frame_cost_ = cost.refit + cost.trace;
    if (cost.new_tree) {
        model_.learn(cost_ratio_, trace_, cost.cost_ratio, cost.trace);
        debt_ = 0;
    }
    if (cost.build_pending) return;
    debt_ += excess(cost.trace, cost.cost_ratio);
    trace_ = cost.trace;
    cost_ratio_ = cost.cost_ratio;
}

}  // namespace morphray
