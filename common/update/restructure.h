// Builds new levels of a tree over the subtrees that are still sound.
#pragma once

#include "common/bvh/builder/layout.h"

namespace mray {

/// The areas of a tree as it is.
BuiltAreas built_areas(const Bvh& bvh);

// If more than this part of all triangles is loose, a build does not cost much more.
inline constexpr double kMostLoose = 0.5;

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

/// Builds new levels, with new leaves, over the triangles `loose` and the subtrees of `parts`.
/// Returns the number of both. Returns 0, and changes nothing, if there are fewer than two or the
/// tree would become too deep. Runs in the calling thread's arena.
std::size_t build_above(const Topology& topology, std::span<const vec3> positions,
                        const TreeParts& parts, std::vector<std::uint32_t> loose, double growth,
                        Bvh& bvh, BuiltAreas& areas);

/// Builds new levels over the largest sound subtrees, in which no box has grown by more than
/// kSoundGrowth (beyond `growth`, that of the triangles themselves), and the triangles of all other
/// leaves: those with triangles of several bodies grow, with the nodes above them. If they have
/// more than `most` of all triangles, only the leaves that have grown most are taken, so that a
/// long restructuring can be done in slices. Runs in the calling thread's arena.
///
/// The boxes and vertices of the tree must be those of the pose. Writes nodes, parents, levels, new
/// leaves (in the places of removed ones, or at the end) and `areas`. Afterwards nodes are in
/// breadth-first order, leaves are not. The result depends only on the arguments. Returns the
/// number of subtrees and triangles under the new levels. Returns 0, and changes nothing, if all is
/// sound, if a build would not cost much more, or if the tree would become too deep.
///
/// Based on: S. Yoon, S. Curtis, D. Manocha. Ray tracing dynamic scenes using selective
/// restructuring. EGSR 2007; there pairs of nodes are restructured in turn.
std::size_t restructure(const Topology& topology, std::span<const vec3> positions, double growth,
                        double most, Bvh& bvh, BuiltAreas& areas);

/// The largest growth of a sound box: a flat square that turns about its edge has up to 1.9.
inline constexpr double kSoundGrowth = 2;

}  // namespace mray
