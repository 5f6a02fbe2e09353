#include "common/bvh/bvh.h"

#include <set>

#include "common/base/hash.h"

namespace mray {
namespace {

/// Sets the ranges of a subtree, a child of a node, and of all below it.
IndexRange find_prims(const Bvh& bvh, std::uint32_t child, std::vector<IndexRange>& ranges) {
    IndexRange all = {kNoPrim, 0};
    const auto add = [&](const IndexRange& range) {
        all = {std::min(all.begin, range.begin), std::max(all.end, range.end)};
    };
    if (!is_leaf(child)) {
        for_each_child(bvh.nodes[child], [&](std::uint32_t, std::uint32_t below) {
            add(find_prims(bvh, below, ranges));
        });
        return ranges[child] = all;
    }
    const Leaf& leaf = bvh.leaves[leaf_of(child)];
    const std::uint32_t count = corner_triangle_count(leaf.vertex[0].corners);
    for (const std::uint32_t prim_id : std::span(leaf.prim_id).first(count)) {
        add({prim_id, prim_id + 1});
        for (const RepeatedTriangle& repeat : repeats_of(bvh.repeated, prim_id))
            add({repeat.prim_id, repeat.prim_id + 1});
    }
    return ranges[bvh.nodes.size() + leaf_of(child)] = all;
}

}  // namespace

std::vector<IndexRange> prim_ranges(const Bvh& bvh) {
    std::vector<IndexRange> ranges(bvh.nodes.size() + bvh.leaves.size());
    if (!bvh.nodes.empty()) find_prims(bvh, 0, ranges);
    return ranges;
}

std::uint64_t bvh_hash(const Bvh& bvh) {
    return Hasher().add(std::span(bvh.nodes)).add(std::span(bvh.leaves)).digest();
}

void add_repeated(Bvh& bvh, std::vector<RepeatedTriangle> more) {
    if (more.empty()) return;
    std::ranges::sort(more, {}, &RepeatedTriangle::prim_id);
    // A triangle that stood for others may have another one stand for it now.
    for (RepeatedTriangle& old : bvh.repeated) {
        const auto found =
            std::ranges::lower_bound(more, old.first, {}, &RepeatedTriangle::prim_id);
        if (found != more.end() && found->prim_id == old.first) old.first = found->first;
    }
    bvh.repeated.insert(bvh.repeated.end(), more.begin(), more.end());
    std::sort(bvh.repeated.begin(), bvh.repeated.end());
}

BvhStats bvh_stats(const Bvh& bvh) {
    BvhStats stats;
    stats.node_count = static_cast<std::uint32_t>(bvh.nodes.size());
    stats.leaf_count = static_cast<std::uint32_t>(bvh.leaves.size());
    stats.depth = bvh.depth();
    stats.bytes = bvh.nodes.size() * sizeof(Node) + bvh.leaves.size() * sizeof(Leaf);
    const double root_area = half_area(node_box(bvh.nodes.front()));
    double area_sum = root_area;
    std::uint64_t children = 0;
    std::uint64_t triangles = 0;
    std::uint64_t vertices = 0;
    for (const Node& node : bvh.nodes) {
        for_each_child(node, [&](std::uint32_t slot, std::uint32_t child) {
            ++children;
            const double area = half_area(slot_box(node, slot));
            if (!is_leaf(child)) {
                area_sum += area;
                return;
            }
            const std::uint32_t leaf = leaf_of(child);
            const std::uint32_t count = corner_triangle_count(bvh.leaves[leaf].vertex[0].corners);
            area_sum += area * count;
            triangles += count;
            const auto own = vertices_of(bvh.leaf_vertices, leaf);
            vertices += std::set<std::uint32_t>(own.begin(), own.end()).size();
        });
    }
    stats.sah_cost = root_area > 0 ? area_sum / root_area : 0;
    stats.children_per_node = static_cast<double>(children) / stats.node_count;
    if (stats.leaf_count > 0) {
        stats.triangles_per_leaf = static_cast<double>(triangles) / stats.leaf_count;
        stats.vertices_per_leaf = static_cast<double>(vertices) / stats.leaf_count;
    }
    return stats;
}

}  // namespace mray
