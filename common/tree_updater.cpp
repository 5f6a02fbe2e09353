#include "common/tree_updater.h"

#include <fmt/format.h>

#include <cassert>
#include <cmath>
#include <utility>

#include "common/error.h"
#include "common/stopwatch.h"

namespace morphray {
namespace {

// What things are taken to cost where clocks may not decide: about the milliseconds of one core of
// a server (docs/layout.md, docs/cpu_tracer.md), a tracer between the CPU's packets and a device.
constexpr double kRefitPerTriangle = 1.5e-6;
constexpr double kBuildPerTriangle = 100e-6;
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
        case TreeStep::kRebuilt:
            return "rebuild";
        default:
            return "swap";
    }
}

TreeUpdater::TreeUpdater(const Topology& topology, std::span<const vec3> positions, Backend& tracer,
                         Backend* refitter, std::unique_ptr<UpdatePolicy> policy,
                         const BuildConfig& build_config, const UpdateConfig& config)
    : topology_(topology),
      tracer_(tracer),
      refitter_(refitter),
      policy_(std::move(policy)),
      build_config_(build_config),
      deterministic_(config.deterministic),
      follows_ratio_(config.record_cost_ratio || policy_->needs_cost_ratio()),
      sample_(topology) {
    build(positions);
    tracer_.set_scene(topology_, positions, bvh_);
    last_.upload_ms = tracer_.times().upload_ms;
    if (refitter_ != nullptr) refitter_->set_scene(topology_, positions, bvh_);
    last_.reason = "the first tree";
    policy_->built(cost_of_frame().rebuild);
}

void TreeUpdater::build(std::span<const vec3> positions) {
    const Stopwatch watch;
    bvh_ = build_bvh(topology_, positions, build_config_);
    last_.rebuild_ms = watch.ms();
    if (follows_ratio_) built_fit_ = {tree_cost(bvh_.nodes), sample_.area(positions)};
    last_.cost_ratio = 1;
}

void TreeUpdater::hand_over(std::span<const vec3> positions) {
    tracer_.set_frame(positions, bvh_);
    last_.upload_ms += tracer_.times().upload_ms;
    if (refitter_ != nullptr) refitter_->set_frame(positions, bvh_);
}

void TreeUpdater::refit(std::span<const vec3> positions, RefitExtent extent) {
    Backend& refitter = refitter_ != nullptr ? *refitter_ : tracer_;
    refitter.refit(positions, extent);
    last_.refit_ms += refitter.times().refit_ms;
    last_.upload_ms += refitter.times().upload_ms;
    const bool moved = extent == RefitExtent::kAll || refitter.times().refitted_leaves > 0;
    if (last_.step != TreeStep::kSwapped) {
        last_.step = moved ? TreeStep::kRefitted : TreeStep::kKept;
    }
    if (refitter_ == nullptr || !moved) return;
    const Stopwatch upload;
    refitter_->read_bvh(bvh_);
    tracer_.set_frame(positions, bvh_);
    last_.upload_ms += upload.ms();
}

/// What is being built behind is of an older pose than the tree that was built just now. Only where
/// clocks must not count is it waited for; otherwise it is taken when it is ready, and dropped.
void TreeUpdater::forget_behind() {
    if (deterministic_ && behind_.pending()) behind_.take();
    behind_is_stale_ = behind_.pending();
}

bool TreeUpdater::swap_is_due() {
    if (behind_is_stale_ && behind_.ready()) {
        behind_.take();
        behind_is_stale_ = false;
    }
    if (!behind_.pending() || behind_is_stale_) return false;
    return deterministic_ ? behind_frames_left_ == 0 : behind_.ready();
}

void TreeUpdater::swap(std::span<const vec3> positions) {
    BackgroundBuild::Result result = behind_.take();
    bvh_ = std::move(result.bvh);
    if (follows_ratio_) built_fit_ = {tree_cost(bvh_.nodes), behind_triangle_area_};
    hand_over(positions);
    last_.step = TreeStep::kSwapped;
    last_.reason = fmt::format("for the tree that was built behind in {:.1f} ms", result.build_ms);
    refit(positions, RefitExtent::kAll);
}

const TreeUpdate& TreeUpdater::update(std::span<const vec3> positions) {
    if (positions.size() != topology_.vertex_count) {
        throw Error(ExitCode::kBadInput,
                    fmt::format("{} vertices for a tree over {}: the topology has changed, which "
                                "takes a new scene",
                                positions.size(), topology_.vertex_count));
    }
    last_ = {};
    if (behind_frames_left_ > 0) --behind_frames_left_;
    const UpdateDecision plan = policy_->plan();
    if (plan.step == UpdateStep::kRebuild) {
        follow(plan, positions);
        return last_;
    }
    if (swap_is_due()) {
        swap(positions);
    } else {
        refit(positions, RefitExtent::kMoved);
        last_.reason = plan.reason;
    }
    const Stopwatch watch;
    if (follows_ratio_) {
        last_.cost_ratio = cost_ratio(built_fit_, {tracer_.tree_cost(), sample_.area(positions)});
    }
    const UpdateDecision decision =
        policy_->review({last_.cost_ratio, behind_.pending(), last_.step == TreeStep::kSwapped});
    // What is found only for the record is nobody's cost.
    if (policy_->needs_cost_ratio()) last_.decide_ms = watch.ms();
    follow(decision, positions);
    return last_;
}

void TreeUpdater::follow(const UpdateDecision& decision, std::span<const vec3> positions) {
    if (last_.step != TreeStep::kSwapped || decision.step == UpdateStep::kRebuild) {
        last_.reason = decision.reason;
    }
    if (decision.step == UpdateStep::kRebuild) {
        forget_behind();
        build(positions);
        hand_over(positions);
        last_.step = TreeStep::kRebuilt;
    } else if (decision.step == UpdateStep::kRebuildBehind && !behind_.pending()) {
        behind_.start(topology_, positions, build_config_.split);
        behind_triangle_area_ = sample_.area(positions);
        behind_frames_left_ = decision.build_frames;
    }
    last_.build_pending = behind_.pending();
}

FrameCost TreeUpdater::cost_of_frame() const {
    FrameCost cost;
    cost.cost_ratio = last_.cost_ratio;
    cost.new_tree = last_.step != TreeStep::kRefitted && last_.step != TreeStep::kKept;
    cost.build_pending = last_.build_pending;
    const bool built = last_.rebuild_ms > 0;
    if (deterministic_) {
        const auto triangles = static_cast<double>(topology_.triangles.size());
        cost.refit = kRefitPerTriangle * triangles;
        cost.rebuild = built ? kBuildPerTriangle * triangles : 0;
        cost.trace = kTracePerRay * static_cast<double>(tracer_.times().rays) *
                     std::pow(std::max(1.0, last_.cost_ratio), kTraceExponent);
        return cost;
    }
    cost.refit = last_.refit_ms + last_.decide_ms + (built ? 0 : last_.upload_ms);
    cost.rebuild = built ? last_.rebuild_ms + last_.upload_ms : 0;
    cost.trace = tracer_.times().trace_ms;
    return cost;
}

void TreeUpdater::frame_done() { policy_->frame_done(cost_of_frame()); }

const Bvh& TreeUpdater::tree() {
    tracer_.read_bvh(bvh_);
    return bvh_;
}

}  // namespace morphray
