#include "common/update/replace_triangles.h"

#include <algorithm>
#include <utility>

#include "common/bvh/box.h"

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
        for (std::uint32_t node = bvh_.leaf_parents[leaf] / kWidth; nodes_[node] == 0;
             node = bvh_.node_parents[node] / kWidth)
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

/// Gives the triangles of a leaf their new ids and vertices. Returns false, and changes nothing,
/// if one of them is gone.
bool renumber_leaf(const TopologyChange& change, Leaf& leaf, std::uint32_t* vertices) {
    const auto* const end = std::find(leaf.prim_id, leaf.prim_id + kLeafTriangles, kNoPrim);
    const auto is_gone = [&](std::uint32_t id) { return change.prim_ids[id] == kNoPrim; };
    if (std::any_of(std::as_const(leaf.prim_id), end, is_gone)) return false;
    for (std::uint32_t* id = leaf.prim_id; id != end; ++id) *id = change.prim_ids[*id];
    for (std::uint32_t slot = 0; slot < kLeafVertices; ++slot)
        vertices[slot] = change.vertices[vertices[slot]];
    return true;
}

void renumber_repeated(const TopologyChange& change, std::vector<RepeatedTriangle>& repeated) {
    for (RepeatedTriangle& triangle : repeated)
        triangle = {change.prim_ids[triangle.first], change.prim_ids[triangle.prim_id]};
    std::erase_if(repeated, [](const auto& triangle) { return triangle.prim_id == kNoPrim; });
}

Box box_of(const Topology& topology, std::span<const vec3> positions, const IndexRange& range) {
    Box box;
    for (std::uint32_t prim_id = range.begin; prim_id < range.end; ++prim_id)
        box.extend(make_ref(topology, positions, prim_id).box());
    return box;
}

}  // namespace

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
        if (renumber_leaf(change, leaf, &bvh.leaf_vertices[std::size_t{i} * kLeafVertices]))
            continue;
        opened.open_leaf(i);
        for (const std::uint32_t id : leaf.prim_id) {
            if (id != kNoPrim && change.prim_ids[id] != kNoPrim)
                loose.push_back(change.prim_ids[id]);
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
