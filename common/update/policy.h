// Policies decide when a tree is refitted, restructured or rebuilt; TreeUpdater acts on it. A
// policy sees costs, not clocks or trees, so equal numbers give equal decisions.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>

namespace mray {

enum class PolicyKind { kRefit, kRebuild, kEvery, kAuto };

/// The most frames that one tree of kEvery may be used for.
inline constexpr std::uint32_t kMostPeriod = 1000000;

struct PolicySpec {
    PolicyKind kind = PolicyKind::kRefit;
    /// The frames that a tree is used for, from 1 to kMostPeriod; 0 for kinds other than kEvery.
    std::uint32_t period = 0;
    bool operator==(const PolicySpec&) const = default;
};

/// "refit", "rebuild", "every:8" or "auto".
std::string text_of(const PolicySpec& policy);

/// Reads what text_of() writes. Throws Error(kBadArgument), which lists the forms, for other texts.
PolicySpec parse_policy(const std::string& text);

/// The texts of all kinds, with "every:K" for a count, in the order of the help text.
std::span<const std::string> policy_forms();

enum class UpdateStep {
    kRefit,
    kRestructure,          // restructure degraded parts (common/update/restructure.h)
    kRebuild,              // build before this frame is traced
    kRebuildInBackground,  // refit this frame, and start a build at its pose for a later one
};

/// A step, and its reason as a clause for people, such as "due".
struct UpdateDecision {
    UpdateStep step = UpdateStep::kRefit;
    std::string reason;
    /// For kRebuildInBackground: the frames that the build takes at most, or exactly
    /// (deterministic).
    std::uint32_t build_frames = 0;
    /// For kRestructure: the part of all triangles that may be restructured.
    double most_restructured = 1;
};

/// A tree that has just been refitted to the pose that is to be traced.
struct RefittedTree {
    /// overhead_visits() since its build.
    double overhead = 0;
    /// Whether a background build is running; a second one cannot start.
    bool build_pending = false;
    /// Whether it was built in the background and is in use for the first time.
    bool new_tree = false;
    /// True if it was restructured in this frame; `overhead` was measured after that.
    bool restructured = false;
};

/// The costs of a frame, all in one unit (ms, or counted). A stage that did not happen is 0.
struct FrameCost {
    double refit = 0;
    /// With passing the tree on.
    double restructure = 0;
    /// The build and the upload of its tree, if the tree was built in this frame.
    double rebuild = 0;
    double trace = 0;
    /// The part of the rays that are not of images, which lose more by a bad tree.
    double single_part = 0;
    /// overhead_visits() of the tree that was traced.
    double overhead = 0;
    /// Whether the traced tree is another one than in the frame before.
    bool new_tree = false;
    /// Whether a background build was running, which makes the other times longer.
    bool build_pending = false;
};

/// For each frame TreeUpdater calls plan(); after kRefit it calls review(), and again after a
/// restructuring; then frame_done(). The tree is built before the first frame.
class UpdatePolicy {
public:
    virtual ~UpdatePolicy() = default;

    /// Decides before any work: kRefit or kRebuild.
    virtual UpdateDecision plan() = 0;
    /// Decides after the refit; kRefit if the refitted tree is good enough.
    virtual UpdateDecision review(const RefittedTree&) { return {UpdateStep::kRefit, "asked for"}; }
    /// Whether review() reads RefittedTree::overhead or restructures: a pass over the nodes.
    virtual bool needs_tree_cost() const { return false; }
    /// Report the cost of the first build, and then the costs of each frame.
    virtual void built(double /*cost*/) {}
    virtual void frame_done(const FrameCost&) {}
};

/// Settings of all policies.
struct UpdateConfig {
    /// Decide by counts of triangles and rays instead of times, so that all runs decide the same.
    bool deterministic = false;
    /// The time that an update may add to a frame, unless the same frame's trace gains as much: a
    /// part of the frame's refit and trace, or ms if budget_ms is above 0.
    double budget = 0.75;
    double budget_ms = 0;
    /// The first guess of the part of a sound trace that an overhead visit takes.
    double first_per_visit = 0.001;
    /// Find the cost ratio of every frame for the record, even if the policy does not use it.
    bool record_cost_ratio = false;
};

/// The period of a kEvery must be at least 1.
std::unique_ptr<UpdatePolicy> make_update_policy(const PolicySpec& policy,
                                                 const UpdateConfig& config = {});

}  // namespace mray
