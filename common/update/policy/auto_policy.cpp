#include "common/update/policy/auto_policy.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace mray {
namespace {

// Up to this loss a tree counts as sound: the model is no more exact than that.
constexpr double kSound = 0.01;

// The part of each frame's refit and trace that may be invested.
constexpr double kInvested = 0.05;

// Whatever the budget: a tree that is older when it is shown is no better than the one before.
constexpr double kMostBuildFrames = 64;

// A first restructuring is taken to cost this part of a build.
constexpr double kFirstRestructureCost = 0.4;

// The next one is taken to cost this part of the last: the first takes apart every leaf that
// straddles two bodies, those after it find most of that done. Where each costs the same, asking
// early loses little.
constexpr double kNextRestructureCost = 0.5;

// A triangle that is restructured costs this many times a triangle of a build: nodes and leaves are
// laid out again around it.
constexpr double kRestructuredTriangle = 2;

// A restructuring that takes away less than this part of the excess did not help.
constexpr double kHelpful = 0.3;
constexpr int kLongestWait = 64;

// A build was measured once, perhaps when all was cold or busy. Each one that runs in the
// background makes its price this much less certain, down to a part of what was measured, so that a
// build that is little over the budget is tried in a frame again.
constexpr double kFading = 0.9;
constexpr double kFaded = 0.7;

}  // namespace

double AutoPolicy::loss(double excess) const {
    const double lost = model_.slowdown(excess) - 1;
    return lost <= kSound ? 0 : lost;
}

double AutoPolicy::residual(double excess) const {
    return loss(wait_ > 0 || traces_ == 0 ? excess : std::min(excess, floor_));
}

double AutoPolicy::restructure_cost() const {
    const double whole = restructure_cost_ > 0 ? kNextRestructureCost * restructure_cost_
                                               : kFirstRestructureCost * build_cost_;
    return std::min(whole, budget());
}

std::string AutoPolicy::facts(double excess) const {
    return fmt::format("{:.1f} excess visits, a frame loses {:.1f} %", excess, 100 * loss(excess));
}

UpdateDecision AutoPolicy::plan() { return {UpdateStep::kRefit, "a refit comes first"}; }

bool AutoPolicy::should_restructure(double excess) const {
    if (wait_ > 0 || traces_ == 0) return false;
    const double avoidable = loss(excess) - residual(excess);
    const double price = restructure_price();
    return avoidable >= price ||
           (purse_ >= restructure_cost() && restructurings_.is_due(avoidable, price));
}

void AutoPolicy::judge_restructuring(double excess) {
    const bool helped = asked_excess_ - excess >= kHelpful * asked_excess_;
    backoff_ = helped ? backoff_ / 2 : std::clamp(2 * backoff_, 1, kLongestWait);
    wait_ = helped ? 0 : backoff_;
    floor_ = excess;
}

UpdateDecision AutoPolicy::review(const RefittedTree& tree) {
    const std::string known = facts(tree.excess);
    if (tree.restructured) judge_restructuring(tree.excess);
    if (loss(tree.excess) == 0) return {UpdateStep::kRefit, "sound: " + known};
    if (!tree.restructured && !tree.new_tree && should_restructure(tree.excess)) {
        asked_excess_ = tree.excess;
        return {.step = UpdateStep::kRestructure,
                .reason = "restructuring pays: " + known,
                .most_restructured = budget() / (kRestructuredTriangle * build_cost_)};
    }
    return rebuild_when_due(tree);
}

UpdateDecision AutoPolicy::rebuild_when_due(const RefittedTree& tree) const {
    const double now = residual(tree.excess);
    const double price = build_price();
    const std::string known =
        facts(tree.excess) +
        fmt::format(", {:.2f} of a build lost, {:.2f} in the purse, backoff {}",
                    builds_.lost() / price, purse_ / build_cost_, builds_.backoff());
    if (now >= price) return {UpdateStep::kRebuild, "pays at once: " + known};
    if (tree.new_tree) return {UpdateStep::kRefit, "a new tree: " + known};
    if (tree.build_pending) return {UpdateStep::kRefit, "a build runs in the background: " + known};
    if (purse_ < build_cost_ || !builds_.is_due(now, price))
        return {UpdateStep::kRefit, "not yet due: " + known};
    if (build_cost_ <= budget()) return {UpdateStep::kRebuild, "due: " + known};
    return {UpdateStep::kRebuildInBackground, "due, and over the budget: " + known,
            static_cast<std::uint32_t>(build_frames())};
}

double AutoPolicy::budget() const {
    return config_.budget_ms > 0 ? config_.budget_ms : config_.budget * frame_cost_;
}

double AutoPolicy::build_frames() const {
    return std::min(std::ceil(build_cost_ / budget()), kMostBuildFrames);
}

void AutoPolicy::remember_trace(double sound_trace) {
    last_traces_[traces_++ % last_traces_.size()] = sound_trace;
    std::array<double, 5> traces = last_traces_;
    const auto end = traces.begin() + static_cast<std::ptrdiff_t>(std::min(traces_, traces.size()));
    const auto middle = traces.begin() + (end - traces.begin() - 1) / 2;
    std::nth_element(traces.begin(), middle, end);
    sound_trace_ = *middle;
}

/// Adds this frame's share and savings, and takes what its remedies cost.
void AutoPolicy::balance_purse(const FrameCost& cost) {
    const bool swapped = cost.new_tree && cost.rebuild == 0;
    const double unavoidable = residual(cost.excess);
    const double saved =
        builds_.add(unavoidable) + restructurings_.add(loss(cost.excess) - unavoidable);
    purse_ += kInvested * (cost.refit + cost.trace) + saved * sound_trace_;
    purse_ -= cost.rebuild + cost.restructure + (swapped ? build_cost_ : 0);
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
        model_.learn(excess_, trace_, cost.excess, cost.trace);
        model_.forget_watched();
        restructurings_.start_over(restructure_price());
    }
    if (cost.new_tree) {
        builds_.start_over(build_price());
        floor_ = 0;
    }
    balance_purse(cost);
    wait_ = std::max(0, wait_ - 1);
    if (cost.build_pending) return;
    remember_trace(cost.trace / model_.slowdown(cost.excess));
    model_.watch(cost.excess, cost.trace);
    trace_ = cost.trace;
    excess_ = cost.excess;
}

}  // namespace mray
