#include "common/bvh/builder/layout.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include "common/bvh/builder/collapse.h"

namespace mray {
namespace {

/// Finds the places of all nodes and leaves, then all threads fill them.
class Layout {
public:
    Layout(const Topology& topology, std::span<const vec3> positions, BinaryTree& binary,
           const TreeParts& parts, double growth, const Watch& watch, const Bvh& old,
           const BuiltAreas& old_areas)
        : topology_(topology),
          positions_(positions),
          binary_(binary),
          parts_(parts),
          growth_(growth),
          watch_(watch),
          old_(old),
          old_areas_(old_areas),
          collapse_(binary),
          free_(parts.removed_leaves),
          leaf_parents_(old.leaf_parents) {
        std::sort(free_.begin(), free_.end(), std::greater<>());
    }

    /// Returns false if the tree becomes too deep.
    bool find_places() {
        areas_.leaves = old_areas_.leaves;
        nodes_.reserve(old_.nodes.size());
        place(true, 0, kNoParent, binary_.nodes.empty() ? 0 : area_of(binary_.nodes.front()));
        for (std::uint32_t begin = 0; begin < nodes_.size(); begin = level_begin_.back()) {
            const auto depth = static_cast<std::uint32_t>(level_begin_.size()) - 1;
            if (depth == kMaxDepth) return false;
            level_begin_.push_back(static_cast<std::uint32_t>(nodes_.size()));
            for (std::uint32_t i = begin; i < level_begin_.back(); ++i) {
                watch_.throw_if_cancelled();
                nodes_[i].is_new ? place_children_of_new(i, depth) : place_children_of_old(i);
            }
        }
        return true;
    }

    void fill(Bvh& bvh, BuiltAreas& areas) {
        AlignedVector<Node> nodes(nodes_.size());
        for_each(nodes.size(), [&](std::size_t i) { fill_node(nodes[i], nodes_[i]); });
        // Slots of old subtrees have their boxes. Children come after their parents.
        for (std::size_t i = nodes.size(); i-- > 1;)
            if (nodes_[i].is_new) unite_slots(nodes, node_parents_, i);
        // The costs of the collapse, which lie in `spare`, are not read any more.
        if (bvh.leaves.empty() && binary_.spare.size() >= leaf_parents_.size())
            bvh.leaves = std::move(binary_.spare);
        resize_leaves(bvh, leaf_parents_.size());
        for_each(new_leaves_.size(), [&](std::size_t i) {
            const auto& [leaf, child] = new_leaves_[i];
            const BinaryNode& source = binary_.nodes[child];
            fill_leaf(binary_.shape(source), binary_.triangles(source), positions_,
                      bvh.leaves[leaf], vertices_of(bvh.leaf_vertices, leaf).data());
        });
        bvh.nodes = std::move(nodes);
        bvh.node_parents = std::move(node_parents_);
        bvh.leaf_parents = std::move(leaf_parents_);
        bvh.level_begin = std::move(level_begin_);
        areas = std::move(areas_);
        // Holes are filled from the end.
        for (const std::uint32_t hole : free_) {
            move_leaf(bvh, areas, static_cast<std::uint32_t>(bvh.leaf_parents.size()) - 1, hole);
            bvh.leaf_parents.pop_back();
            areas.leaves.pop_back();
        }
        resize_leaves(bvh, bvh.leaf_parents.size());
    }

private:
    /// A node of the binary tree or of the old one.
    struct PlacedNode {
        bool is_new;
        std::uint32_t source;
        /// Its place in new_nodes_, or that of the first of its children that are nodes.
        std::uint32_t first = 0;
    };
    struct NewNode {
        WideChildren children;
        PerSlot<std::uint32_t> entries;
    };

    template <class Fill>
    void for_each(std::size_t count, Fill fill) const {
        using Range = tbb::blocked_range<std::size_t>;
        tbb::parallel_for(Range(0, count, 128), [&](const Range& range) {
            watch_.throw_if_cancelled();
            for (std::size_t i = range.begin(); i != range.end(); ++i) fill(i);
        });
    }

    float area_of(const BinaryNode& node) const {
        return static_cast<float>(half_area(node.box) / growth_);
    }

    static void resize_leaves(Bvh& bvh, std::size_t count) {
        bvh.leaves.resize(count);
        bvh.leaf_vertices.resize(vertices_at(count));
    }

    static void move_leaf(Bvh& bvh, BuiltAreas& areas, std::uint32_t from, std::uint32_t to) {
        if (from == to) return;
        bvh.leaves[to] = bvh.leaves[from];
        std::ranges::copy(vertices_of(bvh.leaf_vertices, from),
                          vertices_of(bvh.leaf_vertices, to).begin());
        const std::uint32_t parent = bvh.leaf_parents[from];
        bvh.leaf_parents[to] = parent;
        set_child(bvh.nodes[parent_node(parent)], parent_slot(parent), leaf_child(to));
        areas.leaves[to] = areas.leaves[from];
    }

    /// Gives the next free node to a source and returns its index.
    std::uint32_t place(bool is_new, std::uint32_t source, std::uint32_t parent, float area) {
        nodes_.push_back({is_new, source});
        node_parents_.push_back(parent);
        areas_.nodes.push_back(area);
        return static_cast<std::uint32_t>(nodes_.size()) - 1;
    }

    std::uint32_t place_old(std::uint32_t child, std::uint32_t parent) {
        if (!is_leaf(child)) return place(false, child, parent, old_areas_.nodes[child]);
        leaf_parents_[leaf_of(child)] = parent;
        return child;
    }

    std::uint32_t place_leaf(std::uint32_t child, std::uint32_t parent) {
        if (free_.empty()) {
            free_.push_back(static_cast<std::uint32_t>(leaf_parents_.size()));
            leaf_parents_.push_back(parent);
            areas_.leaves.push_back(0);
        }
        const std::uint32_t leaf = free_.back();
        free_.pop_back();
        leaf_parents_[leaf] = parent;
        areas_.leaves[leaf] = area_of(binary_.nodes[child]);
        new_leaves_.emplace_back(leaf, child);
        return leaf_child(leaf);
    }

    bool is_old(const BinaryNode& leaf) const {
        return binary_.prim_ids[leaf.begin] >= topology_.triangles.size();
    }

    std::uint32_t place_new(std::uint32_t child, std::uint32_t parent) {
        const BinaryNode& source = binary_.nodes[child];
        if (!source.is_leaf()) return place(true, child, parent, area_of(source));
        if (!is_old(source)) return place_leaf(child, parent);
        const std::size_t part = binary_.prim_ids[source.begin] - topology_.triangles.size();
        return place_old(parts_.subtrees[part], parent);
    }

    WideChildren children_of(std::uint32_t source, std::uint32_t depth) const {
        if (binary_.nodes.empty()) return {};
        if (!binary_.nodes[source].is_leaf()) return collapse_.children(source, depth);
        WideChildren only;  // a scene of one leaf
        only.add(source);
        return only;
    }

    void place_children_of_new(std::uint32_t index, std::uint32_t depth) {
        nodes_[index].first = static_cast<std::uint32_t>(new_nodes_.size());
        NewNode& node = new_nodes_.emplace_back();
        node.children = children_of(nodes_[index].source, depth);
        std::uint32_t slot = 0;
        for (const std::uint32_t child : node.children.nodes()) {
            node.entries[slot] = place_new(child, parent_at(index, slot));
            ++slot;
        }
    }

    void place_children_of_old(std::uint32_t index) {
        nodes_[index].first = static_cast<std::uint32_t>(nodes_.size());
        for_each_child(old_.nodes[nodes_[index].source], [&](auto slot, std::uint32_t child) {
            place_old(child, parent_at(index, slot));
        });
    }

    void fill_node(Node& node, const PlacedNode& placed) const {
        if (!placed.is_new) {
            node = old_.nodes[placed.source];
            std::uint32_t next = placed.first;
            for_each_child(node, [&](std::uint32_t slot, std::uint32_t child) {
                if (!is_leaf(child)) set_child(node, slot, next++);
            });
            return;
        }
        const NewNode& from = new_nodes_[placed.first];
        std::uint32_t slot = 0;
        for (const std::uint32_t child : from.children.nodes()) {
            // Old subtrees have their pads; nodes get their boxes when all are filled.
            const BinaryNode& source = binary_.nodes[child];
            const bool is_new_leaf = source.is_leaf() && !is_old(source);
            set_slot_box(node, slot, is_new_leaf ? padded(source.box) : source.box);
            set_child(node, slot, from.entries[slot]);
            ++slot;
        }
        clear_slots(node, slot);
    }

    const Topology& topology_;
    std::span<const vec3> positions_;
    BinaryTree& binary_;
    const TreeParts& parts_;
    double growth_;
    const Watch& watch_;
    const Bvh& old_;
    const BuiltAreas& old_areas_;
    Collapse collapse_;
    std::vector<PlacedNode> nodes_;
    std::vector<NewNode> new_nodes_;
    /// Removed leaves whose place is free, descending.
    std::vector<std::uint32_t> free_;
    /// The places of new leaves, and their binary nodes.
    std::vector<std::pair<std::uint32_t, std::uint32_t>> new_leaves_;
    std::vector<std::uint32_t> node_parents_;
    std::vector<std::uint32_t> leaf_parents_;
    std::vector<std::uint32_t> level_begin_ = {0};
    BuiltAreas areas_;
};

}  // namespace

bool lay_out(const Topology& topology, std::span<const vec3> positions, BinaryTree& binary,
             const TreeParts& parts, double growth, const Watch& watch, Bvh& bvh,
             BuiltAreas& areas) {
    Layout layout(topology, positions, binary, parts, growth, watch, bvh, areas);
    if (!layout.find_places()) return false;
    layout.fill(bvh, areas);
    bvh.triangle_count = static_cast<std::uint32_t>(topology.triangles.size());
    add_repeated(bvh, std::move(binary.repeated));
    return true;
}

}  // namespace mray
