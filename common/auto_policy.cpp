#include "common/auto_policy.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace morphray {
namespace {

// Up to here a tree counts as sound: the ratio itself is no more exact than that (a tree built for
// the frame is within 5 % of the refitted one's cost either way on waves and cloth).
constexpr double kSound = 1.05;

// Whatever the budget: a tree that is older when it is shown is no better than the one before.
constexpr double kMostBuildFrames = 64;

// A scene that changes its ways is noticed after so many times the cost of a build.
constexpr double kMostPatience = 16;

}  // namespace

double AutoPolicy::loss(double cost_ratio) const {
    return cost_ratio <= kSound ? 0 : model_.slowdown(cost_ratio) - 1;
}

UpdateDecision AutoPolicy::plan() { return {UpdateStep::kRefit, "a refit comes first"}; }

UpdateDecision AutoPolicy::review(const RefittedTree& tree) {
    if (std::isinf(tree.cost_ratio)) {
        return {UpdateStep::kRebuild, "the tree was built for a scene without extent"};
    }
    const double now = loss(tree.cost_ratio);
    if (now == 0) {
        return {UpdateStep::kRefit, fmt::format("cost ratio {:.2f}: sound", tree.cost_ratio)};
    }
    const std::string facts = fmt::format(
        "cost ratio {:.2f}, a frame loses {:.1f} %, {:.2f} of a build lost, patience {}",
        tree.cost_ratio, 100 * now, lost_ / price(), patience_);
    if (now > price()) return {UpdateStep::kRebuild, "a jump: " + facts};
    if (tree.new_tree) return {UpdateStep::kRefit, "a new tree: " + facts};
    if (tree.build_pending) return {UpdateStep::kRefit, "a build goes on behind: " + facts};
    // In whole frames, both rules count half of the frame to come.
    const double lost = lost_ + now / 2;
    const double threshold = patience_ * price();
    const bool is_due = (frames_ + 1) * now - lost >= threshold;
    const bool is_overdue = lost >= threshold;
    if (!is_due && !is_overdue) return {UpdateStep::kRefit, "not yet due: " + facts};
    const std::string why = (is_due ? "due: " : "overdue: ") + facts;
    const double share = config_.budget_ms > 0 ? config_.budget_ms : config_.budget * frame_cost_;
    if (build_cost_ <= share) return {UpdateStep::kRebuild, why};
    const double build_frames = std::min(std::ceil(build_cost_ / share), kMostBuildFrames);
    return {UpdateStep::kRebuildBehind, "over the budget, " + why,
            static_cast<std::uint32_t>(build_frames)};
}

void AutoPolicy::remember_trace(double sound_trace) {
    last_traces_[traces_++ % last_traces_.size()] = sound_trace;
    std::array<double, 5> sorted = last_traces_;
    const auto end =
        sorted.begin() + static_cast<std::ptrdiff_t>(std::min(traces_, last_traces_.size()));
    std::sort(sorted.begin(), end);
    sound_trace_ = sorted[static_cast<std::size_t>(end - sorted.begin() - 1) / 2];
}

void AutoPolicy::start_over() {
    if (loss_before_ > 0) {
        const bool paid = saved_ >= price() / 2;
        patience_ = std::clamp(paid ? patience_ / 2 : patience_ * 2, 1.0, kMostPatience);
    }
    loss_before_ = last_loss_;
    frames_ = lost_ = saved_ = 0;
}

void AutoPolicy::frame_done(const FrameCost& cost) {
    if (cost.rebuild > 0) build_cost_ = cost.rebuild;
    frame_cost_ = cost.refit + cost.trace;
    if (cost.new_tree) {
        model_.learn(cost_ratio_, trace_, cost.cost_ratio, cost.trace);
        model_.forget_watched();
        start_over();
    }
    last_loss_ = loss(cost.cost_ratio);
    frames_ += 1;
    lost_ += last_loss_;
    saved_ += loss_before_ - last_loss_;
    if (cost.build_pending) return;
    remember_trace(cost.trace / model_.slowdown(cost.cost_ratio));
    model_.watch(cost.cost_ratio, cost.trace);
    trace_ = cost.trace;
    cost_ratio_ = cost.cost_ratio;
}

}  // namespace morphray
