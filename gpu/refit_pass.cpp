#include "gpu/refit_pass.h"

#include <algorithm>
#include <utility>

namespace morphray::gpu {
namespace {

// Far below what any device allows; refit dispatches of 2^22 leaves or nodes stay short.
constexpr std::uint32_t kMaxGroups = 1u << 16;

// A dispatch takes 10 to 65 us on lavapipe, as long as refitting some thousand leaves, and a copy
// of its own as long: few ranges, gaps filled.
constexpr std::size_t kMostRanges = 8;

std::uint32_t groups_of(std::uint32_t items) { return (items + kGroupSize - 1) / kGroupSize; }

/// Dispatches one after the other.
class Sequence {
public:
    Sequence(const Context& context, VkCommandBuffer commands)
        : commands_(commands),
          max_groups_(std::min(context.limits().maxComputeWorkGroupCount[0], kMaxGroups)) {}

    void add(const Pipeline& pipeline, IndexRange range) {
        while (range.begin < range.end) {
            const std::uint32_t groups = std::min(groups_of(range.end - range.begin), max_groups_);
            const std::uint32_t count = std::min(range.end - range.begin, groups * kGroupSize);
            // Writer: the level below, or leaves of another range, which validation cannot tell
            // from those of this one; reader: this dispatch.
            if (!std::exchange(first_, false)) {
                barrier(commands_, VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT, VK_ACCESS_SHADER_WRITE_BIT,
                        VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT,
                        VK_ACCESS_SHADER_READ_BIT | VK_ACCESS_SHADER_WRITE_BIT);
            }
            pipeline.dispatch(commands_, RefitArguments{.first = range.begin, .count = count},
                              groups);
            range.begin += count;
        }
    }

private:
    VkCommandBuffer commands_;
    std::uint32_t max_groups_;
    bool first_ = true;
};

}  // namespace

void upload_positions(SceneBuffers& scene, Transfer& transfer, const PoseMemory& pose,
                      const RefitPlan& plan) {
    if (plan.all) {
        scene.set_positions(transfer, pose.positions());
        return;
    }
    std::vector<std::uint32_t> blocks;
    for (std::uint32_t block = 0; block < pose.block_count(); ++block) {
        if (pose.moved(block)) blocks.push_back(block);
    }
    for (const IndexRange range : covering_ranges(blocks, kMostRanges)) {
        scene.set_positions(
            transfer, pose.positions(),
            {range.begin * kMotionBlock, std::min(range.end * kMotionBlock, scene.vertex_count())});
    }
}

double refit_scene(Context& context, const Kernels& kernels, const SceneBuffers& scene,
                   const RefitPlan& plan) {
    if (plan.leaf_count == 0) return 0;
    const std::vector<std::uint32_t>& levels = scene.level_begin();
    const std::vector<IndexRange> leaves = plan.all
                                               ? std::vector{IndexRange{0, scene.leaf_count()}}
                                               : covering_ranges(plan.parts.leaves, kMostRanges);
    return context.submit("refit", [&](VkCommandBuffer commands) {
        Sequence sequence(context, commands);
        for (const IndexRange range : leaves) sequence.add(kernels.refit_leaves, range);
        for (std::size_t level = levels.size() - 2; level > 0; --level) {
            IndexRange range = {levels[level], levels[level + 1]};
            if (!plan.all) {
                const auto [first, last] =
                    std::pair(std::ranges::lower_bound(plan.parts.nodes, range.begin),
                              std::ranges::lower_bound(plan.parts.nodes, range.end));
                if (first == last) continue;
                range = {*first, *(last - 1) + 1};
            }
            sequence.add(kernels.refit_nodes, range);
        }
    });
}

}  // namespace morphray::gpu
