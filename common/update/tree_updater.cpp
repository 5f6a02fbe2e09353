#include "common/update/tree_updater.h"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <utility>

#include "common/base/errors.h"
#include "common/base/stopwatch.h"

namespace mray {
namespace {

// Costs that stand for clocks in deterministic decisions: about the milliseconds that one core of a
// server takes, with a tracer between the CPU's packets and a device.
constexpr double kRefitPerTriangle = 1.5e-6;
constexpr double kBuildPerTriangle = 100e-6;
constexpr double kRestructurePerTriangle = 10e-6;
constexpr double kTracePerRay = 20e-6;
constexpr double kTraceExponent = 0.3;

}  // namespace

const char* name_of(TreeStep step) {
    switch (step) {
        case TreeStep::kBuilt:
            return "build";
        case TreeStep::kKept:
            return "keep";
        case TreeStep::kRefitted:
            return "refit";
        case TreeStep::kRestructured:
            return "restructure";
        case TreeStep::kRebuilt:
            return "rebuild";
        default:
            return "swap";
    }
}

TreeUpdater::TreeUpdater(const Topology& topology, std::span<const vec3> positions, Backend& tracer,
                         Backend* refitter, std::unique_ptr<UpdatePolicy> policy,
                         const BuildConfig& build_config, const UpdateConfig& config,
                         const Bvh* tree)
    : topology_(topology),
      tracer_(tracer),
      refitter_(refitter),
      policy_(std::move(policy)),
      build_config_(build_config),
      deterministic_(config.deterministic),
      follows_ratio_(config.record_cost_ratio || policy_->needs_tree_cost()),
      sample_(topology) {
    if (tree == nullptr) {
        build(positions);
        last_.reason = "the first tree";
    } else {
        bvh_ = *tree;
        took_tree(follows_ratio_ ? sample_.area(positions) : 0);
        last_.reason = "a copy of another scene's tree";
    }
    tracer_.set_scene(topology_, positions, bvh_);
    last_.times.upload_ms = tracer_.times().update.upload_ms;
    if (refitter_ != nullptr) {
        refitter_->set_scene(topology_, positions, bvh_);
        last_.times.upload_ms += refitter_->times().update.upload_ms;
    }
    // A copied tree tells nothing of the time of a build.
    const double estimate = kBuildPerTriangle * static_cast<double>(topology_.triangles.size());
    policy_->built(tree == nullptr ? cost_of_frame({}).rebuild : estimate);
}

void TreeUpdater::build(std::span<const vec3> positions) {
    const Stopwatch watch;
    bvh_ = build_bvh(topology_, positions, build_config_);
    last_.times.rebuild_ms = watch.ms();
    took_tree(follows_ratio_ ? sample_.area(positions) : 0);
    last_.cost_ratio = 1;
    last_.excess = 0;
}

/// Notes the built state of bvh_, which comes into use; its pose has this triangle_area.
void TreeUpdater::took_tree(double triangle_area) {
    if (follows_ratio_) built_fit_ = tree_fit(bvh_.nodes, triangle_area);
    if (policy_->may_restructure()) areas_ = built_areas(bvh_);
}

/// Gives bvh_ to a backend.
void TreeUpdater::hand_to(Backend& backend, std::span<const vec3> positions) {
    backend.set_frame(positions, bvh_);
    last_.times.upload_ms += backend.times().update.upload_ms;
}

/// Gives bvh_ to tracer and refitter.
void TreeUpdater::hand_over(std::span<const vec3> positions) {
    take_refit_times();
    hand_to(tracer_, positions);
    if (refitter_ != nullptr) hand_to(*refitter_, positions);
}

/// Gives the refitter's tree to the tracer.
void TreeUpdater::pass_on_refitted(std::span<const vec3> positions) {
    if (refitter_ == nullptr) return;
    refitter_->read_tree(bvh_);
    tracer_.set_frame(positions, bvh_);
}

void TreeUpdater::refit(std::span<const vec3> positions, RefitExtent extent,
                        std::span<const IndexRange> changed) {
    const std::uint64_t leaves = refitter().refit(positions, extent, changed);
    refitted_ = true;
    const bool moved = extent == RefitExtent::kAll || leaves > 0;
    if (last_.step != TreeStep::kSwapped) {
        last_.step = moved ? TreeStep::kRefitted : TreeStep::kKept;
    }
    // A tracer may leave its refit to the trace: frame_done() takes the times of that.
    if (refitter_ == nullptr) return;
    take_refit_times();
    if (!moved) return;
    const Stopwatch upload;
    pass_on_refitted(positions);
    last_.times.upload_ms += upload.ms();
}

void TreeUpdater::take_refit_times() {
    if (!std::exchange(refitted_, false)) return;
    const UpdateTimes& times = refitter().times().update;
    last_.times.refit_ms += times.refit_ms;
    last_.times.upload_ms += times.upload_ms;
}

/// Finishes a refit that would have waited for the trace. Returns the milliseconds that this took
/// beyond the refit itself.
double TreeUpdater::wait_for_refit() {
    const Stopwatch watch;
    const double refit_ms = last_.times.refit_ms;
    take_refit_times();
    return std::max(0.0, watch.ms() - (last_.times.refit_ms - refit_ms));
}

/// Marks the build in the background as stale, since its pose is older than that of the tree that
/// was just built. Deterministic updates wait for it; others drop it when it is ready.
void TreeUpdater::forget_background_build() {
    if (deterministic_ && background_.pending()) background_.take();
    background_is_stale_ = background_.pending();
}

bool TreeUpdater::swap_is_due() {
    if (background_is_stale_) {
        if (!background_.ready()) return false;
        background_.take();
        background_is_stale_ = false;
    }
    if (!background_.pending()) return false;
    return deterministic_ ? background_frames_left_ == 0 : background_.ready();
}

void TreeUpdater::swap(std::span<const vec3> positions) {
    BackgroundBuild::Result result = background_.take();
    bvh_ = std::move(result.bvh);
    took_tree(background_triangle_area_);
    // A tracer that does not refit itself gets the refitted tree.
    hand_to(refitter(), positions);
    last_.step = TreeStep::kSwapped;
    last_.reason =
        fmt::format("for the tree that was built in the background in {:.1f} ms", result.build_ms);
    refit(positions, RefitExtent::kAll, kAllIndices);
}

const TreeUpdate& TreeUpdater::update(std::span<const vec3> positions,
                                      std::span<const IndexRange> changed) {
    if (positions.size() != topology_.vertex_count) {
        throw Error(ErrorKind::kBadInput,
                    fmt::format("{} vertices for a tree over {}: the topology has changed, which "
                                "takes a new scene",
                                positions.size(), topology_.vertex_count));
    }
    last_ = {};
    restructured_ = refitted_ = false;
    passed_on_ms_ = 0;
    if (background_frames_left_ > 0) --background_frames_left_;
    const UpdateDecision plan = policy_->plan();
    if (plan.step == UpdateStep::kRebuild) {
        follow(plan, positions);
        return last_;
    }
    if (swap_is_due()) {
        swap(positions);
    } else {
        refit(positions, RefitExtent::kMoved, changed);
        last_.reason = plan.reason;
    }
    UpdateDecision decision = review(positions, false);
    if (decision.step == UpdateStep::kRestructure) {
        last_.reason = decision.reason;
        restructure(positions, decision.most_restructured);
        decision = review(positions, true);
    }
    follow(decision, positions);
    return last_;
}

double TreeUpdater::growth(std::span<const vec3> positions) const {
    const double now = sample_.area(positions);
    return now > 0 && built_fit_.triangle_area > 0 ? now / built_fit_.triangle_area : 1;
}

UpdateDecision TreeUpdater::review(std::span<const vec3> positions, bool restructured) {
    const double waited_ms = follows_ratio_ ? wait_for_refit() : 0;
    const Stopwatch watch;
    if (follows_ratio_) {
        const TreeFit fit = tree_fit(tracer_.nodes(), sample_.area(positions));
        last_.cost_ratio = cost_ratio(built_fit_, fit);
        last_.excess = excess_visits(built_fit_, fit);
    }
    UpdateDecision decision = policy_->review({.excess = last_.excess,
                                               .build_pending = background_.pending(),
                                               .new_tree = last_.step == TreeStep::kSwapped,
                                               .restructured = restructured});
    // A ratio that is found for the record only is not a cost of the policy.
    if (policy_->needs_tree_cost()) last_.times.decide_ms += waited_ms + watch.ms();
    return decision;
}

/// Restructures the worst parts, up to `most` of all triangles.
void TreeUpdater::restructure(std::span<const vec3> positions, double most) {
    const Stopwatch watch;
    std::size_t parts = 0;
    refitter().edit_tree([&](Bvh& bvh) {
        const Stopwatch inner;
        parts = mray::restructure(topology_, positions, growth(positions), most, bvh, areas_);
        last_.times.restructure_ms = inner.ms();
        return parts > 0;
    });
    if (parts > 0) {
        last_.step = TreeStep::kRestructured;
        last_.reason += fmt::format(", of {} parts", parts);
        pass_on_refitted(positions);
    }
    passed_on_ms_ = watch.ms() - last_.times.restructure_ms;
    last_.times.upload_ms += passed_on_ms_;
    restructured_ = true;
}

void TreeUpdater::follow(const UpdateDecision& decision, std::span<const vec3> positions) {
    const bool has_reason =
        last_.step == TreeStep::kSwapped || last_.step == TreeStep::kRestructured;
    if (!has_reason || decision.step != UpdateStep::kRefit) last_.reason = decision.reason;
    if (decision.step == UpdateStep::kRebuild) {
        forget_background_build();
        build(positions);
        hand_over(positions);
        last_.step = TreeStep::kRebuilt;
    } else if (decision.step == UpdateStep::kRebuildInBackground && !background_.pending()) {
        background_.start(topology_, positions, build_config_.split);
        background_triangle_area_ = sample_.area(positions);
        background_frames_left_ = decision.build_frames;
    }
    last_.build_pending = background_.pending();
}

FrameCost TreeUpdater::cost_of_frame(const TraceCost& trace) const {
    FrameCost cost;
    cost.excess = last_.excess;
    const bool built = last_.step == TreeStep::kBuilt || last_.step == TreeStep::kRebuilt;
    cost.new_tree = built || last_.step == TreeStep::kSwapped;
    cost.build_pending = last_.build_pending;
    if (deterministic_) {
        const auto triangles = static_cast<double>(topology_.triangles.size());
        cost.refit = kRefitPerTriangle * triangles;
        cost.restructure = restructured_ ? kRestructurePerTriangle * triangles : 0;
        cost.rebuild = built ? kBuildPerTriangle * triangles : 0;
        cost.trace = kTracePerRay * static_cast<double>(trace.rays) *
                     std::pow(std::max(1.0, last_.cost_ratio), kTraceExponent);
        return cost;
    }
    const UpdateTimes& times = last_.times;
    cost.refit = times.refit_ms + times.decide_ms + (built ? 0 : times.upload_ms - passed_on_ms_);
    cost.restructure = times.restructure_ms + (built ? 0 : passed_on_ms_);
    cost.rebuild = built ? times.rebuild_ms + times.upload_ms : 0;
    cost.trace = trace.ms;
    return cost;
}

void TreeUpdater::frame_done(const TraceCost& trace) {
    settle();
    policy_->frame_done(cost_of_frame(trace));
}

const TreeUpdate& TreeUpdater::settle() {
    if (refitter_ == nullptr) take_refit_times();
    return last_;
}

const Bvh& TreeUpdater::tree() {
    tracer_.read_tree(bvh_);
    return bvh_;
}

}  // namespace mray
