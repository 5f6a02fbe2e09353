#include "common/update/restructure.h"

#include <optional>
#include <utility>

#include "common/bvh/builder/binary_tree.h"
#include "common/bvh/builder/collapse.h"

namespace mray {
namespace {

/// Lays out new nodes, new leaves and old subtrees, with nodes breadth first.
class Relayout {
public:
    Relayout(const Topology& topology, std::span<const vec3> positions, const Bvh& old,
             const BuiltAreas& old_areas, const TreeParts& parts, const BinaryTree& binary,
             double growth)
        : topology_(topology),
          positions_(positions),
          old_(old),
          old_areas_(old_areas),
          parts_(parts),
          binary_(binary),
          collapse_(binary.nodes),
          growth_(growth),
          free_(parts.removed_leaves),
          leaf_count_(static_cast<std::uint32_t>(old.leaves.size())) {
        std::sort(free_.begin(), free_.end(), std::greater<>());
    }

    /// Finds the places of nodes and leaves. Returns false if the tree becomes too deep.
    bool arrange() {
        nodes_.reserve(old_.nodes.size() + binary_.nodes.size());
        leaf_parents_ = old_.leaf_parents;
        areas_.leaves = old_areas_.leaves;
        sources_ = {{true, 0}};
        node_parents_ = {kNoParent};
        level_begin_ = {0};
        areas_.nodes = {area_of(binary_.nodes.front())};
        for (std::uint32_t begin = 0; begin < sources_.size();) {
            if (level_begin_.size() > kMaxDepth) return false;
            const auto end = static_cast<std::uint32_t>(sources_.size());
            nodes_.resize(end);
            for (std::uint32_t i = begin; i < end; ++i)
                sources_[i].is_new ? add_new(i) : add_old(i);
            level_begin_.push_back(end);
            begin = end;
        }
        // Slots of old subtrees have their boxes. Children come after their parents.
        for (std::size_t i = nodes_.size(); i-- > 1;)
            if (sources_[i].is_new) unite_slots(nodes_, node_parents_, i);
        return true;
    }

    void commit(Bvh& bvh, BuiltAreas& areas) {
        resize_leaves(bvh, std::max(leaf_count_, static_cast<std::uint32_t>(bvh.leaves.size())));
        for (const auto& [leaf, source] : new_leaves_) {
            fill_leaf(binary_.shape(source), binary_.triangles(source), positions_,
                      bvh.leaves[leaf], vertices_of(bvh.leaf_vertices, leaf).data());
        }
        bvh.nodes = std::move(nodes_);
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
        resize_leaves(bvh, static_cast<std::uint32_t>(bvh.leaf_parents.size()));
    }

private:
    /// A node of the binary tree, or of the old one.
    struct Source {
        bool is_new;
        std::uint32_t index;
    };

    float area_of(const BinaryNode& node) const {
        return static_cast<float>(half_area(node.box) / growth_);
    }

    static void resize_leaves(Bvh& bvh, std::uint32_t count) {
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
    std::uint32_t place(Source source, std::uint32_t parent, float area) {
        sources_.push_back(source);
        node_parents_.push_back(parent);
        areas_.nodes.push_back(area);
        return static_cast<std::uint32_t>(sources_.size()) - 1;
    }

    std::uint32_t place_old(std::uint32_t child, std::uint32_t parent) {
        if (!is_leaf(child)) return place({false, child}, parent, old_areas_.nodes[child]);
        leaf_parents_[leaf_of(child)] = parent;
        return child;
    }

    std::uint32_t place_leaf(const BinaryNode& source, std::uint32_t parent) {
        std::uint32_t leaf = leaf_count_;
        if (free_.empty()) {
            ++leaf_count_;
            leaf_parents_.push_back(parent);
            areas_.leaves.push_back(0);
        } else {
            leaf = free_.back();
            free_.pop_back();
        }
        leaf_parents_[leaf] = parent;
        areas_.leaves[leaf] = area_of(source);
        new_leaves_.emplace_back(leaf, source);
        return leaf_child(leaf);
    }

    void add_old(std::uint32_t index) {
        nodes_[index] = old_.nodes[sources_[index].index];
        for_each_child(nodes_[index], [&](std::uint32_t slot, std::uint32_t child) {
            set_child(nodes_[index], slot, place_old(child, parent_at(index, slot)));
        });
    }

    void add_new(std::uint32_t index) {
        const auto depth = static_cast<std::uint32_t>(level_begin_.size()) - 1;
        const WideChildren children = collapse_.children(sources_[index].index, depth);
        Node& node = nodes_[index];
        std::uint32_t slot = 0;
        for (const std::uint32_t child : children.nodes()) {
            // Old subtrees and leaves have their pads; nodes get their boxes when all are placed.
            const BinaryNode& source = binary_.nodes[child];
            const bool is_new_leaf = source.is_leaf() && !is_old(source);
            set_slot_box(node, slot, is_new_leaf ? padded(source.box) : source.box);
            set_child(node, slot, place_new(child, parent_at(index, slot)));
            ++slot;
        }
        clear_slots(node, slot);
    }

    bool is_old(const BinaryNode& leaf) const {
        return binary_.prim_ids[leaf.begin] >= topology_.triangles.size();
    }

    std::uint32_t place_new(std::uint32_t child, std::uint32_t parent) {
        const BinaryNode& source = binary_.nodes[child];
        const auto area = area_of(source);
        if (!source.is_leaf()) return place({true, child}, parent, area);
        if (is_old(source)) {
            const std::size_t part = binary_.prim_ids[source.begin] - topology_.triangles.size();
            return place_old(parts_.subtrees[part], parent);
        }
        return place_leaf(source, parent);
    }

    const Topology& topology_;
    std::span<const vec3> positions_;
    const Bvh& old_;
    const BuiltAreas& old_areas_;
    const TreeParts& parts_;
    const BinaryTree& binary_;
    Collapse collapse_;
    double growth_;
    std::vector<Source> sources_;
    /// Removed leaves whose place is free, descending.
    std::vector<std::uint32_t> free_;
    std::uint32_t leaf_count_;
    std::vector<std::pair<std::uint32_t, BinaryNode>> new_leaves_;

    AlignedVector<Node> nodes_;
    std::vector<std::uint32_t> node_parents_;
    std::vector<std::uint32_t> leaf_parents_;
    std::vector<std::uint32_t> level_begin_;
    BuiltAreas areas_;
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

std::size_t build_above(const Topology& topology, std::span<const vec3> positions,
                        const TreeParts& parts, std::vector<std::uint32_t> loose, double growth,
                        Bvh& bvh, BuiltAreas& areas) {
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
    Relayout relayout(topology, positions, bvh, areas, parts, binary, growth);
    if (!relayout.arrange()) return 0;
    relayout.commit(bvh, areas);
    add_repeated(bvh, std::move(binary.repeated));
    return count;
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
    return build_above(topology, positions, parts, std::move(loose), growth, bvh, areas);
}

}  // namespace mray
