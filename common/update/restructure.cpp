#include "common/update/restructure.h"

#include <algorithm>
#include <functional>
#include <optional>
#include <utility>

namespace mray {
namespace {

/// The sound parts of a tree: boxes that have kept their size, and nodes above only such boxes.
class Soundness {
public:
    Soundness(const Bvh& bvh, const BuiltAreas& areas, double limit)
        : areas_(areas), limit_(limit), whole_(bvh.nodes.size(), 1) {
        // Children come after their parents.
        for (std::size_t i = bvh.nodes.size(); i-- > 0;) {
            for_each_child(bvh.nodes[i], [&](std::uint32_t slot, std::uint32_t child) {
                if (!is_sound(bvh.nodes[i], slot, child)) whole_[i] = 0;
            });
        }
    }

    /// Whether all below a node is sound; its own box does not count.
    bool is_whole(std::uint32_t node) const { return whole_[node] != 0; }

    /// Whether a child and all below it is sound.
    bool is_sound(const Node& node, std::uint32_t slot, std::uint32_t child) const {
        if (!is_leaf(child) && !is_whole(child)) return false;
        const float built = is_leaf(child) ? areas_.leaves[leaf_of(child)] : areas_.nodes[child];
        return half_area(slot_box(node, slot)) <= limit_ * double{built};
    }

private:
    const BuiltAreas& areas_;
    double limit_;
    std::vector<std::uint8_t> whole_;
};

/// The growth of leaf boxes beyond which a leaf is restructured: `limit`, or more if the leaves
/// beyond it hold more than `most` of the triangles, assumed to be spread evenly. None if a build
/// would not cost much more than to restructure them.
std::optional<double> limit_of_slice(const Bvh& bvh, const BuiltAreas& areas, double limit,
                                     double most) {
    std::vector<double> grown;
    const auto leaves = static_cast<double>(bvh.leaf_parents.size());
    for (const Node& node : bvh.nodes) {
        for_each_child(node, [&](std::uint32_t slot, std::uint32_t child) {
            if (!is_leaf(child)) return;
            const double area = half_area(slot_box(node, slot));
            const double built = areas.leaves[leaf_of(child)];
            // A box that had no area has grown infinitely; infinity times 0 makes nothing sound.
            if (area > limit * built) grown.push_back(area / built);
        });
    }
    const auto count = static_cast<double>(grown.size());
    if (count > kMostLoose * leaves) return std::nullopt;
    if (count <= most * leaves) return limit;
    const auto place = grown.begin() + static_cast<std::ptrdiff_t>(most * leaves);
    std::nth_element(grown.begin(), place, grown.end(), std::greater<>());
    return *place;
}

}  // namespace

std::size_t restructure(const Topology& topology, std::span<const vec3> positions, double growth,
                        double most, Bvh& bvh, BuiltAreas& areas) {
    const std::optional<double> limit =
        limit_of_slice(bvh, areas, kSoundGrowth * growth, std::max(most, 0.0));
    if (!limit) return 0;
    const Soundness soundness(bvh, areas, *limit);
    if (soundness.is_whole(0)) return 0;
    const TreeParts parts =
        take_apart(bvh, [&](const Node& node, std::uint32_t slot, std::uint32_t child) {
            return soundness.is_sound(node, slot, child);
        });
    std::vector<std::uint32_t> loose;
    const double most_loose = kMostLoose * static_cast<double>(topology.triangles.size());
    for (const std::uint32_t leaf : parts.removed_leaves) {
        for (const std::uint32_t prim_id : bvh.leaves[leaf].prim_id) {
            if (prim_id != kNoPrim) loose.push_back(prim_id);
        }
        if (static_cast<double>(loose.size()) > most_loose) return 0;
    }
    return build_above(topology, positions, parts, std::move(loose), growth, bvh, areas);
}

}  // namespace mray
