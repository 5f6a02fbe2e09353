#include "common/update/replace_triangles.h"

#include <utility>

#include "common/bvh/builder/split.h"

namespace mray {
namespace {

bool overlap(const Box& a, const Box& b) {
    for (int axis = 0; axis < 3; ++axis) {
        if (a.lower[axis] > b.upper[axis] || b.lower[axis] > a.upper[axis]) return false;
    }
    return true;
}

/// The nodes and leaves that are taken apart.
class Opened {
public:
    explicit Opened(const Bvh& bvh)
        : bvh_(bvh), nodes_(bvh.nodes.size()), leaves_(bvh.leaf_parents.size()) {
        nodes_[0] = 1;
    }

    void open_leaf(std::uint32_t leaf) {
        leaves_[leaf] = 1;
        for (std::uint32_t node = parent_node(bvh_.leaf_parents[leaf]); nodes_[node] == 0;
             node = parent_node(bvh_.node_parents[node]))
            nodes_[node] = 1;
    }

    /// Opens the nodes that overlap a box and are larger.
    void open_around(const Box& box, std::uint32_t node = 0) {
        nodes_[node] = 1;
        for_each_child(bvh_.nodes[node], [&](std::uint32_t slot, std::uint32_t child) {
            if (is_leaf(child)) return;
            const Box other = slot_box(bvh_.nodes[node], slot);
            if (overlap(other, box) && half_area(other) > half_area(box)) open_around(box, child);
        });
    }

    bool has(std::uint32_t child) const {
        return is_leaf(child) ? leaves_[leaf_of(child)] != 0 : nodes_[child] != 0;
    }

private:
    const Bvh& bvh_;
    std::vector<std::uint8_t> nodes_;
    std::vector<std::uint8_t> leaves_;
};

/// Gives a leaf's triangles new ids and vertices. False: they do not all stay with one shift.
bool renumber_leaf(const TopologyChange& change, Leaf& leaf, std::span<std::uint32_t> vertices) {
    const std::uint32_t count = corner_triangle_count(leaf.vertex[0].corners);
    const KeptTriangles* const kept = change.find(leaf.prim_id[0]);
    if (kept == nullptr || leaf.prim_id[count - 1] >= kept->before.end) return false;
    if (kept->prim_shift == 0 && kept->vertex_shift == 0) return true;
    for (std::uint32_t i = 0; i < count; ++i) leaf.prim_id[i] += kept->prim_shift;
    for (std::uint32_t& vertex : vertices) vertex += kept->vertex_shift;
    return true;
}

void renumber_repeated(const TopologyChange& change, std::vector<RepeatedTriangle>& repeated) {
    // Both triangles of a pair have the same vertices, and stay or go together.
    std::erase_if(repeated, [&](const auto& pair) { return change.find(pair.prim_id) == nullptr; });
    for (RepeatedTriangle& pair : repeated) {
        const std::uint32_t shift = change.find(pair.prim_id)->prim_shift;
        pair = {pair.first + shift, pair.prim_id + shift};
    }
}

Box box_of(const Topology& topology, std::span<const vec3> positions, const IndexRange& range) {
    AlignedVector<PrimRef> refs(range.end - range.begin);
    make_refs(topology, positions, range.begin, refs);
    return union_of(refs);
}

}  // namespace

void TopologyChange::keep(const KeptTriangles& triangles) {
    const bool continues = !kept.empty() && kept.back().before.end == triangles.before.begin &&
                           kept.back().prim_shift == triangles.prim_shift &&
                           kept.back().vertex_shift == triangles.vertex_shift;
    if (!continues) kept.push_back(triangles);
    kept.back().before.end = triangles.before.end;
}

const KeptTriangles* TopologyChange::find(std::uint32_t prim_id) const {
    const auto after = std::partition_point(
        kept.begin(), kept.end(), [=](const auto& some) { return some.before.end <= prim_id; });
    return after != kept.end() && after->before.begin <= prim_id ? &*after : nullptr;
}

bool replace_triangles(const Topology& topology, std::span<const vec3> positions,
                       const TopologyChange& change, Bvh& bvh, BuiltAreas& areas) {
    const auto most_loose =
        static_cast<std::size_t>(kMostLoose * static_cast<double>(topology.triangles.size()));
    std::size_t count = 0;
    for (const IndexRange& range : change.added) count += range.end - range.begin;
    if (count > most_loose) return false;
    Opened opened(bvh);
    std::vector<std::uint32_t> loose;
    for (std::uint32_t i = 0; i < bvh.leaf_parents.size(); ++i) {
        Leaf& leaf = bvh.leaves[i];
        if (renumber_leaf(change, leaf, vertices_of(bvh.leaf_vertices, i))) continue;
        opened.open_leaf(i);
        for (const std::uint32_t id : leaf.prim_id) {
            if (const KeptTriangles* const kept = id != kNoPrim ? change.find(id) : nullptr)
                loose.push_back(id + kept->prim_shift);
        }
    }
    for (const IndexRange& range : change.added) {
        opened.open_around(box_of(topology, positions, range));
        for (std::uint32_t id = range.begin; id < range.end; ++id) loose.push_back(id);
    }
    if (loose.size() > most_loose) return false;
    renumber_repeated(change, bvh.repeated);
    bvh.triangle_count = static_cast<std::uint32_t>(topology.triangles.size());
    const TreeParts parts = take_apart(
        bvh, [&](const Node&, std::uint32_t, std::uint32_t child) { return !opened.has(child); });
    return build_above(topology, positions, parts, std::move(loose), 1, bvh, areas) > 0;
}

}  // namespace mray
