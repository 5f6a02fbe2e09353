// Keeps a backend's tree at the current pose, as a policy decides.
#pragma once

#include <memory>
#include <span>
#include <string>

#include "common/backend.h"
#include "common/bvh/bvh_builder.h"
#include "common/update/background_build.h"
#include "common/update/policy/update_policy.h"
#include "common/update/tree_cost.h"

namespace morphray {

/// What became of the tree in a frame.
enum class TreeStep {
    kBuilt,  // for the first time
    kKept,   // no vertex has moved
    kRefitted,
    kRestructured,  // after a refit, what was degraded
    kRebuilt,       // in this frame
    kSwapped,       // for one that was built in the background, refitted to this frame
};
/// "build", "keep", "refit", "restructure", "rebuild" or "swap".
const char* name_of(TreeStep step);

/// Times of what did not happen are 0.
struct TreeUpdate {
    TreeStep step = TreeStep::kBuilt;
    std::string reason;
    /// cost_ratio() of the tree since its build; 1 unless the policy asks for it or the config.
    double cost_ratio = 1;
    double upload_ms = 0;  // positions and trees to backends, and between them
    double refit_ms = 0;
    double decide_ms = 0;  // finding the cost ratio, and deciding
    double restructure_ms = 0;
    double rebuild_ms = 0;
    /// Whether a build runs in the background while this frame is traced.
    bool build_pending = false;
};

/// Topology and backends must outlive it.
class TreeUpdater {
public:
    /// Builds at these positions and hands the tree to the tracer. `refitter` is a backend that
    /// refits instead of the tracer, which is then given the trees; null: the tracer refits.
    /// Throws what builder and backends throw.
    TreeUpdater(const Topology& topology, std::span<const vec3> positions, Backend& tracer,
                Backend* refitter, std::unique_ptr<UpdatePolicy> policy, const BuildConfig& build,
                const UpdateConfig& config);

    /// Brings the tracer's tree to this pose. Throws Error(kBadInput), and leaves all as it was,
    /// for another number of vertices: the topology has changed then.
    const TreeUpdate& update(Pose& pose);
    const TreeUpdate& update(std::span<const vec3> positions);
    /// Whether the positions of every pose are looked at: because of the policy, or of a backend
    /// that takes nothing else.
    bool needs_positions() const;
    /// The frame has been traced: tells the policy from the tracer's times what that cost, and
    /// last() what its refit took.
    void frame_done();

    const TreeUpdate& last() const { return last_; }
    /// The tree as it is now, read back from the tracer.
    const Bvh& tree();

private:
    void build(std::span<const vec3> positions);
    void refit(Pose& pose, RefitExtent extent);
    void take_refit_times();
    double wait_for_refit();
    /// Gives the tree to tracer and refitter.
    void hand_over(std::span<const vec3> positions);
    void forget_background_build();
    void took_tree(double triangle_area);
    double growth(std::span<const vec3> positions) const;
    UpdateDecision review(Pose& pose, bool restructured);
    void restructure(Pose& pose);
    bool swap_is_due();
    void swap(Pose& pose);
    void follow(const UpdateDecision& decision, Pose& pose);
    FrameCost cost_of_frame() const;

    const Topology& topology_;
    Backend& tracer_;
    Backend* refitter_;
    std::unique_ptr<UpdatePolicy> policy_;
    BuildConfig build_config_;
    bool deterministic_;
    bool follows_ratio_;
    TriangleSample sample_;
    Bvh bvh_;
    TreeFit built_fit_;
    /// Kept where the policy may restructure.
    BuiltAreas areas_;
    TreeUpdate last_;
    /// Whether the tracer or refitter has refitted, and its times have not been taken yet.
    bool refitted_ = false;
    /// Whether a restructuring was tried in this frame.
    bool restructured_ = false;
    BackgroundBuild background_;
    bool background_is_stale_ = false;
    double background_triangle_area_ = 0;
    std::uint32_t background_frames_left_ = 0;
};

}  // namespace morphray
