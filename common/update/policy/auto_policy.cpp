#include "common/update/policy/auto_policy.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace mray {
namespace {

// Up to here a tree counts as sound: the ratio itself is no more exact than that.
constexpr double kSound = 1.05;

// No frame is to be traced for longer than 1.25 times what a tree built for it would take; the
// model is no more exact than the rest of that.
constexpr double kMostLoss = 0.2;

// A ratio that grows by so much in one frame is beyond what the model has seen, so it is taken to
// cost its square root: less in packets, more on a device whose packets fall apart.
constexpr double kJump = 8;

// Whatever the budget: a tree that is older when it is shown is no better than the one before.
constexpr double kMostBuildFrames = 64;

// A first restructuring is taken to cost this part of a build.
constexpr double kFirstRestructureCost = 0.4;

// The next one is taken to cost this part of the last: the first takes apart every leaf that
// straddles two bodies, those after it find most of that done. Where each costs the same, asking
// early loses little.
constexpr double kNextRestructureCost = 0.5;

// A restructuring that takes away less than this of what the ratio has above 1 did not help.
constexpr double kHelpful = 0.3;
constexpr int kLongestWait = 64;

// A build was measured once, perhaps when all was cold or busy. Each one that runs in the
// background makes its price this much less certain, down to a part of what was measured, so that a
// build which is hardly over the budget is tried in a frame again.
constexpr double kFading = 0.9;
constexpr double kFaded = 0.7;

}  // namespace

double AutoPolicy::loss(double cost_ratio) const {
    return cost_ratio <= kSound ? 0 : model_.slowdown(cost_ratio) - 1;
}

double AutoPolicy::residual(double cost_ratio) const {
    return loss(wait_ > 0 ? cost_ratio : std::min(cost_ratio, floor_ratio_));
}

double AutoPolicy::restructure_cost() const {
    return restructure_cost_ > 0 ? kNextRestructureCost * restructure_cost_
                                 : kFirstRestructureCost * build_cost_;
}

std::string AutoPolicy::facts(double cost_ratio) const {
    return fmt::format("cost ratio {:.2f}, a frame loses {:.1f} %", cost_ratio,
                       100 * loss(cost_ratio));
}

UpdateDecision AutoPolicy::plan() { return {UpdateStep::kRefit, "a refit comes first"}; }

bool AutoPolicy::restructuring_is_due(double cost_ratio) const {
    if (wait_ > 0) return false;
    const double unavoidable = residual(cost_ratio);
    const double avoidable = loss(cost_ratio) - unavoidable;
    const bool loses_most = unavoidable <= kMostLoss && loss(cost_ratio) > kMostLoss;
    return loses_most || avoidable > restructure_price() ||
           restructurings_.is_due(avoidable, restructure_price());
}

void AutoPolicy::judge_restructuring(double cost_ratio) {
    const bool helped = asked_ratio_ - cost_ratio >= kHelpful * (asked_ratio_ - 1);
    backoff_ = helped ? backoff_ / 2 : std::clamp(2 * backoff_, 1, kLongestWait);
    wait_ = helped ? 0 : backoff_;
    floor_ratio_ = cost_ratio;
}

UpdateDecision AutoPolicy::review(const RefittedTree& tree) {
    const std::string known = facts(tree.cost_ratio);
    if (std::isinf(tree.cost_ratio)) {
        return {UpdateStep::kRebuild, "the tree was built for a scene without extent"};
    }
    if (tree.restructured) judge_restructuring(tree.cost_ratio);
    if (loss(tree.cost_ratio) == 0) return {UpdateStep::kRefit, "sound: " + known};
    if (!tree.restructured && !tree.new_tree && restructuring_is_due(tree.cost_ratio)) {
        asked_ratio_ = tree.cost_ratio;
        return {UpdateStep::kRestructure, "restructuring is due: " + known};
    }
    return rebuild_when_due(tree);
}

UpdateDecision AutoPolicy::rebuild_when_due(const RefittedTree& tree) const {
    const double now = residual(tree.cost_ratio);
    const double price = build_price();
    const std::string known =
        facts(tree.cost_ratio) + fmt::format(", {:.2f} of a build lost, backoff {}",
                                             builds_.lost() / price, builds_.backoff());
    const bool jumped = tree.cost_ratio > kJump * last_ratio_;
    if (now > price || (jumped && std::sqrt(tree.cost_ratio) - 1 > price))
        return {UpdateStep::kRebuild, "a jump: " + known};
    if (tree.new_tree) return {UpdateStep::kRefit, "a new tree: " + known};
    if (tree.build_pending) return {UpdateStep::kRefit, "a build runs in the background: " + known};
    const bool is_due = builds_.is_due(now, price);
    if (build_cost_ <= budget()) {
        if (now > kMostLoss) return {UpdateStep::kRebuild, "too slow: " + known};
        if (is_due) return {UpdateStep::kRebuild, "due: " + known};
    } else if (is_due || will_lose_most(tree.cost_ratio)) {
        return {UpdateStep::kRebuildInBackground,
                (is_due ? "due, and over the budget: " : "soon too slow: ") + known,
                static_cast<std::uint32_t>(build_frames())};
    }
    return {UpdateStep::kRefit, "not yet due: " + known};
}

double AutoPolicy::budget() const {
    return config_.budget_ms > 0 ? config_.budget_ms : config_.budget * frame_cost_;
}

double AutoPolicy::build_frames() const {
    return std::min(std::ceil(build_cost_ / budget()), kMostBuildFrames);
}

bool AutoPolicy::will_lose_most(double cost_ratio) const {
    // Where a tree is as slow when it is taken, another one will be, too.
    if (loss(first_ratio_) > kMostLoss) return false;
    const double growth = std::max(0.0, cost_ratio - last_ratio_);
    return residual(cost_ratio + build_frames() * growth) > kMostLoss;
}

void AutoPolicy::remember_trace(double sound_trace) {
    last_traces_[traces_++ % last_traces_.size()] = sound_trace;
    std::array<double, 5> sorted = last_traces_;
    const auto end =
        sorted.begin() + static_cast<std::ptrdiff_t>(std::min(traces_, last_traces_.size()));
    std::sort(sorted.begin(), end);
    sound_trace_ = sorted[static_cast<std::size_t>(end - sorted.begin() - 1) / 2];
}

void AutoPolicy::frame_done(const FrameCost& cost) {
    if (cost.rebuild > 0) {
        build_cost_ = measured_build_cost_ = cost.rebuild;
    } else if (cost.new_tree) {
        build_cost_ = std::max(kFading * build_cost_, kFaded * measured_build_cost_);
    }
    if (cost.restructure > 0) restructure_cost_ = cost.restructure;
    frame_cost_ = cost.refit + cost.trace;
    if (cost.new_tree || cost.restructure > 0) {
        model_.learn(cost_ratio_, trace_, cost.cost_ratio, cost.trace);
        model_.forget_watched();
        restructurings_.start_over(restructure_price());
    }
    if (cost.new_tree) {
        builds_.start_over(build_price());
        floor_ratio_ = 1;
        first_ratio_ = cost.cost_ratio;
    }
    last_ratio_ = cost.cost_ratio;
    const double unavoidable = residual(cost.cost_ratio);
    builds_.add(unavoidable);
    restructurings_.add(loss(cost.cost_ratio) - unavoidable);
    wait_ = std::max(0, wait_ - 1);
    if (cost.build_pending) return;
    remember_trace(cost.trace / model_.slowdown(cost.cost_ratio));
    model_.watch(cost.cost_ratio, cost.trace);
    trace_ = cost.trace;
    cost_ratio_ = cost.cost_ratio;
}

}  // namespace mray
