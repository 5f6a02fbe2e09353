#include "common/bvh/bvh.h"

#include <set>

#include "common/base/hash.h"

namespace mray {

std::vector<IndexRange> prim_ranges(const Bvh& bvh) {
    const std::size_t node_count = bvh.nodes.size();
    std::vector<IndexRange> ranges(node_count + bvh.leaves.size(), {kNoPrim, 0});
    const auto add = [&](std::size_t subtree, const IndexRange& prims) {
        IndexRange& all = ranges[subtree];
        all = {std::min(all.begin, prims.begin), std::max(all.end, prims.end)};
    };
    for (std::size_t i = 0; i < bvh.leaves.size(); ++i) {
        const Leaf& leaf = bvh.leaves[i];
        const std::uint32_t count = corner_triangle_count(leaf.vertex[0].corners);
        for (const std::uint32_t prim_id : std::span(leaf.prim_id).first(count)) {
            add(node_count + i, {prim_id, prim_id + 1});
            for (const RepeatedTriangle& repeat : repeats_of(bvh.repeated, prim_id))
                add(node_count + i, {repeat.prim_id, repeat.prim_id + 1});
        }
    }
    // Parents come before their children.
    for (std::size_t i = node_count; i-- > 0;) {
        for_each_child(bvh.nodes[i], [&](std::uint32_t, std::uint32_t child) {
            add(i, ranges[is_leaf(child) ? node_count + leaf_of(child) : child]);
        });
    }
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
