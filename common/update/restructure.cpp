#include "common/update/restructure.h"

#include <optional>
#include <utility>

namespace mray {
namespace {

// If more than this part of all triangles is loose, a build does not cost much more.
constexpr double kMostLoose = 0.5;

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

/// Takes the tree apart from the root on, down to children that is_sound(node, slot, child) keeps.
template <class IsSound>
TreeParts take_apart(const Bvh& bvh, IsSound is_sound) {
    TreeParts parts;
    std::vector<std::uint8_t> is_open(bvh.nodes.size());
    is_open[0] = 1;
    for (std::size_t i = 0; i < bvh.nodes.size(); ++i) {
        if (is_open[i] == 0) continue;
        const Node& node = bvh.nodes[i];
        for_each_child(node, [&](std::uint32_t slot, std::uint32_t child) {
            if (is_sound(node, slot, child)) {
                parts.subtrees.push_back(child);
                parts.boxes.push_back(slot_box(node, slot));
            } else if (is_leaf(child)) {
                parts.removed_leaves.push_back(leaf_of(child));
            } else {
                is_open[child] = 1;
            }
        });
    }
    return parts;
}

}  // namespace

BuiltAreas built_areas(const Bvh& bvh) {
    BuiltAreas areas;
    areas.nodes.resize(bvh.node_parents.size());
    areas.leaves.resize(bvh.leaf_parents.size());
    areas.nodes[0] = static_cast<float>(half_area(node_box(bvh.nodes.front())));
    for (const Node& node : bvh.nodes) {
        for_each_child(node, [&](std::uint32_t slot, std::uint32_t child) {
            const auto area = static_cast<float>(half_area(slot_box(node, slot)));
            (is_leaf(child) ? areas.leaves[leaf_of(child)] : areas.nodes[child]) = area;
        });
    }
    return areas;
}

std::size_t restructure(const Topology& topology, std::span<const vec3> positions, double growth,
                        double most, Bvh& bvh, BuiltAreas& areas) {
    const std::optional<double> limit =
        limit_of_slice(bvh, areas, kSoundGrowth * growth, std::max(most, 0.0));
    if (!limit) return 0;
    // Whether all below a node is sound; its own box does not count.
    std::vector<std::uint8_t> is_whole(bvh.nodes.size(), 1);
    const auto is_sound = [&](const Node& node, std::uint32_t slot, std::uint32_t child) {
        if (!is_leaf(child) && is_whole[child] == 0) return false;
        const float built = is_leaf(child) ? areas.leaves[leaf_of(child)] : areas.nodes[child];
        return half_area(slot_box(node, slot)) <= *limit * double{built};
    };
    // Children come after their parents.
    for (std::size_t i = bvh.nodes.size(); i-- > 0;) {
        for_each_child(bvh.nodes[i], [&](std::uint32_t slot, std::uint32_t child) {
            if (!is_sound(bvh.nodes[i], slot, child)) is_whole[i] = 0;
        });
    }
    if (is_whole[0] != 0) return 0;
    const TreeParts parts = take_apart(bvh, is_sound);
    std::vector<std::uint32_t> loose;
    const double most_loose = kMostLoose * static_cast<double>(topology.triangles.size());
    for (const std::uint32_t leaf : parts.removed_leaves) {
        for (const std::uint32_t prim_id : bvh.leaves[leaf].prim_id) {
            if (prim_id != kNoPrim) loose.push_back(prim_id);
        }
        if (static_cast<double>(loose.size()) > most_loose) return 0;
    }
    std::sort(loose.begin(), loose.end());
    AlignedVector<PrimRef> refs(loose.size());
    for (std::size_t i = 0; i < loose.size(); ++i)
        make_refs(topology, positions, loose[i], std::span(refs).subspan(i, 1));
    auto id = static_cast<std::uint32_t>(topology.triangles.size());
    for (const Box& box : parts.boxes) refs.push_back({box, id++});
    const std::size_t count = refs.size();
    if (count < 2) return 0;
    BinaryTree binary = build_binary_tree(topology, std::move(refs));
    if (binary.nodes.front().is_leaf()) return 0;
    return lay_out(topology, positions, binary, parts, growth, {}, bvh, areas) ? count : 0;
}

}  // namespace mray
