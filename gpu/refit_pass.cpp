#include "gpu/refit_pass.h"

#include <algorithm>
#include <utility>

namespace mray::gpu {
namespace {

// Dispatches of 2^22 leaves or nodes stay short.
constexpr std::uint32_t kMaxGroups = 1u << 20;

// A dispatch takes 10 to 65 us on lavapipe, as long as the refit of some thousand leaves, and so
// does a copy. So ranges are few, and gaps between them are filled.
constexpr std::size_t kMostRanges = 8;

/// Records dispatches that wait for each other.
class Sequence {
public:
    Sequence(const Context& context, VkCommandBuffer commands)
        : commands_(commands),
          max_groups_(std::min(context.limits().maxComputeWorkGroupCount[0], kMaxGroups)) {}

    void add(const Kernel& kernel, IndexRange range) {
        constexpr std::uint32_t kItemsOfGroup = kGroupSize / kRefitLanes;
        while (range.begin < range.end) {
            const std::uint32_t groups = std::min(
                (range.end - range.begin + kItemsOfGroup - 1) / kItemsOfGroup, max_groups_);
            const std::uint32_t count = std::min(range.end - range.begin, groups * kItemsOfGroup);
            // Writer: the level below, or leaves of another range, which validation cannot tell
            // from those of this one; reader: this dispatch.
            if (!std::exchange(first_, false)) barrier(commands_);
            kernel.dispatch(commands_, RefitArguments{.first = range.begin, .count = count},
                            groups);
            range.begin += count;
        }
    }

private:
    VkCommandBuffer commands_;
    std::uint32_t max_groups_;
    bool first_ = true;
};

/// Vertices whose positions have to go to the device.
std::vector<IndexRange> moved_vertices(const PoseMemory& pose, const RefitPlan& plan) {
    const auto count = static_cast<std::uint32_t>(pose.positions().size());
    if (plan.all && count > 0) return {{0, count}};
    std::vector<IndexRange> ranges = covering_ranges(pose.moved_blocks(), kMostRanges);
    for (IndexRange& range : ranges) {
        range = {range.begin * kMotionBlock, std::min(range.end * kMotionBlock, count)};
    }
    return ranges;
}

/// The leaves or nodes of each dispatch; nodes level by level, the lowest first.
struct Dispatches {
    std::vector<IndexRange> leaves;
    std::vector<IndexRange> nodes;
};

Dispatches dispatches_of(const SceneBuffers& scene, const RefitPlan& plan) {
    const std::vector<std::uint32_t>& levels = scene.level_begin();
    Dispatches d;
    if (plan.leaf_count == 0) return d;
    d.leaves = plan.all ? std::vector{IndexRange{0, scene.leaf_count()}}
                        : covering_ranges(plan.parts.leaves, kMostRanges);
    for (std::size_t level = levels.size() - 2; level > 0; --level) {
        IndexRange range = {levels[level], levels[level + 1]};
        if (!plan.all) {
            const auto [first, last] =
                std::pair(std::ranges::lower_bound(plan.parts.nodes, range.begin),
                          std::ranges::lower_bound(plan.parts.nodes, range.end));
            if (first == last) continue;
            range = {*first, *(last - 1) + 1};
        }
        d.nodes.push_back(range);
    }
    // The root has no parent, but quarters.
    d.nodes.push_back({0, 1});
    return d;
}

}  // namespace

Record refit_scene(Context& context, const Kernels& kernels, SceneBuffers& scene,
                   const PoseMemory& pose, const RefitPlan& plan) {
    Record upload = scene.set_positions(pose.positions(), moved_vertices(pose, plan));
    Dispatches dispatches = dispatches_of(scene, plan);
    if (!upload && dispatches.leaves.empty()) return {};
    return [&context, &kernels, upload = std::move(upload),
            dispatches = std::move(dispatches)](VkCommandBuffer commands) {
        if (upload) upload(commands);
        Sequence sequence(context, commands);
        for (const IndexRange range : dispatches.leaves) sequence.add(kernels.refit_leaves, range);
        for (const IndexRange range : dispatches.nodes) sequence.add(kernels.refit_nodes, range);
    };
}

}  // namespace mray::gpu
