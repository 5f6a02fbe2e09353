// Measures how well a tree fits its triangles, and keeps a tree at the pose of each frame.
#pragma once

#include <atomic>
#include <future>
#include <memory>
#include <optional>

#include "common/backend.h"
#include "common/bvh/builder/bvh_builder.h"
#include "common/bvh/bvh.h"
#include "common/scene/mesh.h"
#include "common/scene/pose.h"
#include "common/update/policy.h"
#include "common/update/restructure.h"

namespace mray {

/// The surface area heuristic: the sum of half the areas of all nodes' boxes, plus kLeafCost times
/// that of the leaves' boxes, in scene units squared, not divided by the root's area: the cost of a
/// box in an image depends on its size there. Finite; 0 for a tree over no triangles.
double tree_cost(std::span<const Node> nodes);

/// At most kMost triangles, evenly by prim_id: their area tells grown triangles from a bad tree.
class TriangleSample {
public:
    explicit TriangleSample(const Topology& topology);

    /// The sum of half the areas of the boxes of sampled triangles that are finite; 0 for none.
    double area(std::span<const vec3> positions) const;

private:
    static constexpr std::size_t kMost = 4096;
    std::vector<uvec3> triangles_;
};

/// The cost of a tree, the size of its triangles and half the area of its root at one pose.
struct TreeFit {
    double cost = 0;
    double triangle_area = 0;
    double root_area = 0;
};
TreeFit tree_fit(std::span<const Node> nodes, double triangle_area);

/// The factor by which the tree fits worse now than when it was built: the ratio of the costs, each
/// divided by the triangles' size if both sizes are above 0. 1 if both costs are 0; infinite if
/// only that of the build is 0 (a tree that was built in a point); never negative.
double cost_ratio(const TreeFit& built, const TreeFit& now);

/// The visits of nodes (a leaf counts as kLeafCost) that a ray through the root makes beyond those
/// in a tree as good as the built one: the growth of the cost beyond that of the triangles, divided
/// by the root's area. 0 if the tree is no worse, or if the root has no area; finite.
double overhead_visits(const TreeFit& built, const TreeFit& now);

// ---- The updater

/// How the tree came to the pose of a frame.
enum class TreeStep {
    kBuilt,  // the first tree
    kKept,   // no vertex moved
    kRefitted,
    kRestructured,  // refitted, and its degraded parts restructured
    kRebuilt,       // built at this pose
    kSwapped,       // replaced by a tree from the background, refitted to this pose
};
/// "build", "keep", "refit", "restructure", "rebuild" or "swap".
const char* name_of(TreeStep step);

struct TreeUpdate {
    TreeStep step = TreeStep::kBuilt;
    std::string reason;
    /// cost_ratio() of the tree since its build; 1 if neither the policy nor the config needs it.
    double cost_ratio = 1;
    /// Likewise overhead_visits(); 0 if neither needs it.
    double overhead = 0;
    UpdateTimes times;
    /// Whether a build runs in the background while this frame is traced.
    bool build_pending = false;
};

/// The cost of tracing a frame.
struct TraceCost {
    double ms = 0;
    std::uint64_t rays = 0;
    /// Rays and points of queries among them, which are not of an image.
    std::uint64_t other_rays = 0;
};

/// Topology, pose and tracer must outlive it.
class TreeUpdater {
public:
    /// Builds a tree at the pose and hands it to the tracer. `tree`, if not null, is a tree at the
    /// pose that is copied instead. Throws what builder and tracer throw.
    TreeUpdater(const Topology& topology, const Pose& pose, Backend& tracer,
                std::unique_ptr<UpdatePolicy> policy, const BuildConfig& build,
                const UpdateConfig& config, const Bvh* tree = nullptr);
    /// Cancels a pending build and waits for its end.
    ~TreeUpdater();

    /// Brings the tracer's tree to the last move of the pose. Call it once after each move.
    const TreeUpdate& update();
    /// Ends a frame that has been traced: finish(), and tells the policy the costs of the frame.
    void frame_done(const TraceCost& trace);
    /// Finishes a refit that was left to the trace, and adds its time to last().
    const TreeUpdate& finish();

    const TreeUpdate& last() const { return last_; }

private:
    // Steps of update(), in the order in which it takes them. They set last_.
    bool swap_is_due();
    void swap();
    void refit(const std::string& reason);
    UpdateDecision review();
    void restructure(const UpdateDecision& decision);
    void rebuild(const std::string& reason);
    void start_background_build(std::uint32_t build_frames);

    Bvh build();
    double pose_area() const;
    void note_built(const Bvh& bvh, double triangle_area);
    void replace_tree(Bvh bvh, double triangle_area);
    UpdateTimes finish_refit();
    FrameCost cost_of_frame(const TraceCost& trace) const;

    const Topology& topology_;
    const Pose& pose_;
    Backend& tracer_;
    std::unique_ptr<UpdatePolicy> policy_;
    BuildConfig build_config_;
    bool deterministic_;
    bool follows_ratio_;
    TriangleSample sample_;
    TreeFit built_fit_;
    /// The areas of the tree in use, if the policy may restructure it.
    BuiltAreas areas_;
    TreeUpdate last_;
    /// Whether the tracer has refitted and finish_refit() has not been called.
    bool has_refitted_ = false;
    /// The times of the restructuring that was tried in this frame.
    std::optional<UpdateTimes> restructuring_;
    /// The build in the background, if it is valid.
    std::atomic<bool> cancel_background_ = false;
    std::future<Bvh> background_;
    int process_ = 0;
    bool background_is_stale_ = false;
    double background_triangle_area_ = 0;
    /// Of the pose that review() measured last.
    double triangle_area_ = 0;
    std::uint32_t background_frames_left_ = 0;
};

}  // namespace mray
