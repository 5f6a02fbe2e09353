// When a tree is refitted, when it is built anew: decided here, carried out by TreeUpdater. A
// policy sees costs and ratios, never clocks or trees, so it decides alike for alike numbers.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>

namespace morphray {

enum class UpdateStep {
    kRefit,
    kRestructure,          // what is degraded, in this frame (common/update/restructure.h)
    kRebuild,              // in this frame, before it is traced
    kRebuildInBackground,  // refit this frame; meanwhile a build at its pose goes on, for a later
                           // one
};

/// What to do, and why: a clause for people, such as "the slow-down has cost a build".
struct UpdateDecision {
    UpdateStep step = UpdateStep::kRefit;
    std::string reason;
    /// Of kRebuildInBackground: the frames that the build may take. One whose decisions must not
    /// depend on clocks takes exactly that many.
    std::uint32_t build_frames = 0;
};

/// A tree that has just been refitted to the pose that is to be traced.
struct RefittedTree {
    /// cost_ratio() since its build.
    double cost_ratio = 1;
    /// Whether a build runs in the background already; another cannot be begun.
    bool build_pending = false;
    /// Whether it is in use for the first time, having been built in the background.
    bool new_tree = false;
    /// Whether it has just been restructured: this is what is left.
    bool restructured = false;
};

/// What a frame has cost, in one unit for all (ms, or as counted): a stage that did not happen is
/// 0.
struct FrameCost {
    double refit = 0;
    double restructure = 0;
    /// Building and handing over, if the tree was built in this frame.
    double rebuild = 0;
    double trace = 0;
    /// cost_ratio() of the tree that was traced.
    double cost_ratio = 1;
    /// Whether the traced tree is another one than the frame before.
    bool new_tree = false;
    /// Whether a build ran in the background, which makes times longer than they would be.
    bool build_pending = false;
};

/// Called for each frame whose pose is new: plan(); if that says kRefit, review(), and again after
/// a restructuring; then frame_done(). The tree is built before the first frame.
class UpdatePolicy {
public:
    virtual ~UpdatePolicy() = default;

    /// Before anything is done: kRefit or kRebuild.
    virtual UpdateDecision plan() = 0;
    /// After the refit: whether it will do.
    virtual UpdateDecision review(const RefittedTree&) { return {UpdateStep::kRefit, "asked for"}; }
    /// Whether review() looks at RefittedTree::cost_ratio, which costs a pass over the nodes.
    virtual bool needs_cost_ratio() const { return false; }
    /// Whether review() may say kRestructure, which takes some book-keeping.
    virtual bool may_restructure() const { return false; }
    /// The first build and, from then on, what became of each frame.
    virtual void built(double /*cost*/) {}
    virtual void frame_done(const FrameCost&) {}
};

/// What all policies may be told besides their name.
struct UpdateConfig {
    /// Decisions from counts of triangles and rays instead of measured times, so that each run
    /// takes the same ones.
    bool deterministic = false;
    /// What an update may add to a frame; a build that takes more runs in the background. As a part
    /// of the frame's refit and trace, or, if above 0, in ms.
    double budget = 0.75;
    double budget_ms = 0;
    /// What tracing is taken to slow down like, a power of the cost ratio, until trees that were
    /// replaced have shown it (SlowdownModel).
    double first_exponent = 0.3;
    /// Find the cost ratio of every frame for the record, whether the policy looks at it or not.
    bool record_cost_ratio = false;
};

struct UpdatePolicyInfo {
    /// "refit", or with a count "every:K".
    const char* form;
    const char* description;
};
/// All there are, in the order in which help lists them.
std::span<const UpdatePolicyInfo> update_policies();

/// The policy of a text such as "auto" or "every:8". Throws Error(kBadArgument), which tells the
/// forms.
std::unique_ptr<UpdatePolicy> make_update_policy(const std::string& text,
                                                 const UpdateConfig& config = {});

}  // namespace morphray
