#include "common/bvh/builder/bvh_builder.h"

#include <fmt/format.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include "common/base/thread_arena.h"
#include "common/bvh/builder/binary_tree.h"
#include "common/bvh/builder/collapse.h"

namespace mray {
namespace {

constexpr std::size_t kGrain = 128;

/// Lays the collapsed tree out breadth first: finds all places, then all threads fill them.
class Layout {
public:
    Layout(const Topology& topology, std::span<const vec3> positions, const Watch& watch,
           BinaryTree& tree)
        : topology_(topology),
          positions_(positions),
          watch_(watch),
          tree_(tree),
          collapse_(tree.nodes, std::as_writable_bytes(std::span(tree.spare))) {}

    Bvh build() {
        bvh_.triangle_count = static_cast<std::uint32_t>(topology_.triangles.size());
        add_repeated(bvh_, std::move(tree_.repeated));
        add_places();
        fill();
        return std::move(bvh_);
    }

private:
    /// A wide node whose boxes are not written yet.
    struct WideNode {
        WideChildren children;
        /// Indices of the first child that is a node and of the first that is a leaf.
        std::uint32_t first_node;
        std::uint32_t first_leaf;
    };

    void add_places() {
        std::vector<std::uint32_t> sources = {0};  // the binary node of each wide node
        bvh_.node_parents = {kNoParent};
        bvh_.level_begin = {0, 1};
        std::uint32_t begin = 0;
        for (std::uint32_t depth = 0; begin < sources.size(); ++depth) {
            const std::uint32_t end = bvh_.level_begin.back();
            for (std::uint32_t i = begin; i < end; ++i) {
                watch_.throw_if_cancelled();
                WideNode& node = wide_nodes_.emplace_back();
                node.children = children_of(sources[i], depth);
                node.first_node = static_cast<std::uint32_t>(sources.size());
                node.first_leaf = static_cast<std::uint32_t>(leaf_sources_.size());
                std::uint32_t parent = parent_at(i, 0);
                for (const std::uint32_t child : node.children.nodes()) {
                    const bool is_leaf = tree_.nodes[child].is_leaf();
                    (is_leaf ? leaf_sources_ : sources).push_back(child);
                    (is_leaf ? bvh_.leaf_parents : bvh_.node_parents).push_back(parent++);
                }
            }
            begin = end;
            if (sources.size() > begin)
                bvh_.level_begin.push_back(static_cast<std::uint32_t>(sources.size()));
        }
    }

    WideChildren children_of(std::uint32_t source, std::uint32_t depth) const {
        if (tree_.nodes.empty()) return {};
        if (!tree_.nodes[source].is_leaf()) return collapse_.children(source, depth);
        WideChildren only;  // a scene of one leaf
        only.add(source);
        return only;
    }

    void fill() {
        bvh_.nodes.resize(wide_nodes_.size());
        // The costs of the collapse, which lie in `spare`, are not read any more.
        if (tree_.spare.size() >= leaf_sources_.size()) bvh_.leaves = std::move(tree_.spare);
        bvh_.leaves.resize(leaf_sources_.size());
        bvh_.leaf_vertices.resize(vertices_at(leaf_sources_.size()));
        using Range = tbb::blocked_range<std::size_t>;
        tbb::parallel_for(Range(0, wide_nodes_.size(), kGrain), [&](const Range& range) {
            watch_.throw_if_cancelled();
            for (std::size_t i = range.begin(); i != range.end(); ++i)
                fill_node(bvh_.nodes[i], wide_nodes_[i]);
        });
        for (std::size_t i = bvh_.nodes.size(); i-- > 1;)
            unite_slots(bvh_.nodes, bvh_.node_parents, i);
        tbb::parallel_for(Range(0, leaf_sources_.size(), kGrain), [&](const Range& range) {
            watch_.throw_if_cancelled();
            for (std::size_t i = range.begin(); i != range.end(); ++i) {
                const BinaryNode& source = tree_.nodes[leaf_sources_[i]];
                fill_leaf(tree_.shape(source), tree_.triangles(source), positions_, bvh_.leaves[i],
                          vertices_of(bvh_.leaf_vertices, i).data());
            }
        });
    }

    void fill_node(Node& node, const WideNode& source) const {
        std::uint32_t next_node = source.first_node;
        std::uint32_t next_leaf = source.first_leaf;
        std::uint32_t slot = 0;
        for (const std::uint32_t child : source.children.nodes()) {
            const BinaryNode& binary = tree_.nodes[child];
            set_slot_box(node, slot, binary.is_leaf() ? padded(binary.box) : Box());
            set_child(node, slot++, binary.is_leaf() ? leaf_child(next_leaf++) : next_node++);
        }
        clear_slots(node, slot);
    }

    const Topology& topology_;
    std::span<const vec3> positions_;
    const Watch& watch_;
    BinaryTree& tree_;
    Collapse collapse_;
    std::vector<WideNode> wide_nodes_;
    std::vector<std::uint32_t> leaf_sources_;
    Bvh bvh_;
};

}  // namespace

Bvh build_bvh(const Topology& topology, std::span<const vec3> positions,
              const BuildConfig& config) {
    if (topology.triangles.size() > kMaxTriangles) {
        throw Error(ErrorKind::kLimit,
                    fmt::format("{} triangles are more than a tree can hold ({})",
                                topology.triangles.size(), kMaxTriangles));
    }
    return ThreadArena(config.threads).execute([&] {
        BinaryTree tree = build_binary_tree(topology, positions, config.target, config.watch);
        return Layout(topology, positions, config.watch, tree).build();
    });
}

}  // namespace mray
