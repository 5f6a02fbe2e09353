#include "common/bvh_builder.h"

#include <fmt/format.h>

#include <algorithm>

#include "common/binary_tree.h"
#include "common/bvh_refit.h"
#include "common/collapse.h"
#include "common/error.h"
#include "common/thread_arena.h"

namespace morphray {
namespace {

constexpr std::size_t kMaxTriangles = std::size_t{1} << 28;

/// Lays the collapsed tree out breadth first.
class Layout {
public:
    Layout(const Topology& topology, BinaryTree& tree)
        : topology_(topology), tree_(tree), collapse_(tree.nodes) {}

    Bvh build() {
        bvh_.triangle_count = static_cast<std::uint32_t>(topology_.triangles.size());
        std::vector<std::uint32_t> level = {add_node(kNoParent)};  // wide nodes
        std::vector<std::uint32_t> sources = {0};  // the binary nodes they are made of
        bvh_.level_begin = {0, 1};
        for (std::uint32_t depth = 0; !level.empty(); ++depth) {
            std::vector<std::uint32_t> next_level;
            std::vector<std::uint32_t> next_sources;
            for (std::size_t i = 0; i < level.size(); ++i) {
                std::uint32_t slot = 0;
                for (const std::uint32_t child : children_of(sources[i], depth)) {
                    const std::uint32_t parent = level[i] * kWidth + slot++;
                    if (tree_.nodes[child].is_leaf()) {
                        add_leaf(parent, tree_.nodes[child]);
                    } else {
                        next_level.push_back(add_node(parent));
                        next_sources.push_back(child);
                    }
                }
            }
            if (!next_level.empty())
                bvh_.level_begin.push_back(static_cast<std::uint32_t>(bvh_.nodes.size()));
            level = std::move(next_level);
            sources = std::move(next_sources);
        }
        return std::move(bvh_);
    }

private:
    std::vector<std::uint32_t> children_of(std::uint32_t source, std::uint32_t depth) const {
        if (tree_.nodes.empty()) return {};
        if (tree_.nodes[source].is_leaf()) return {source};  // a scene of one leaf
        return collapse_.children(source, kMaxDepth - depth);
    }

    void link(std::uint32_t parent, std::uint32_t child) {
        if (parent != kNoParent) bvh_.nodes[parent / kWidth].child[parent % kWidth] = child;
    }

    std::uint32_t add_node(std::uint32_t parent) {
        const auto index = static_cast<std::uint32_t>(bvh_.nodes.size());
        Node& node = bvh_.nodes.emplace_back();
        for (std::uint32_t slot = 0; slot < kWidth; ++slot) {
            set_slot_box(node, slot, Box());
            node.child[slot] = kEmptyChild;
        }
        bvh_.node_parents.push_back(parent);
        link(parent, index);
        return index;
    }

    void add_leaf(std::uint32_t parent, const BinaryNode& source) {
        const std::span<PrimRef> refs(tree_.refs.data() + source.begin, source.end - source.begin);
        std::sort(refs.begin(), refs.end(),
                  [](const PrimRef& a, const PrimRef& b) { return a.prim_id < b.prim_id; });
        const auto index = static_cast<std::uint32_t>(bvh_.leaves.size());
        Leaf& leaf = bvh_.leaves.emplace_back();
        bvh_.leaf_parents.push_back(parent);
        std::vector<std::uint32_t> vertices;
        const auto slot_of = [&](std::uint32_t vertex) {
            const auto found = std::find(vertices.begin(), vertices.end(), vertex);
            const auto slot = static_cast<std::uint32_t>(found - vertices.begin());
            if (found == vertices.end()) vertices.push_back(vertex);
            return slot;
        };
        const auto count = static_cast<std::uint32_t>(refs.size());
        for (std::uint32_t i = 0; i < kLeafTriangles; ++i) {
            leaf.prim_id[i] = kNoPrim;
            leaf.vertex[i].corners = pack_corners(0, 0, 0, count);
            if (i >= count) continue;
            const uvec3 t = topology_.triangles[refs[i].prim_id];
            const std::uint32_t a = slot_of(t.x);
            const std::uint32_t b = slot_of(t.y);
            const std::uint32_t c = slot_of(t.z);
            leaf.prim_id[i] = refs[i].prim_id;
            leaf.vertex[i].corners = pack_corners(a, b, c, count);
        }
        vertices.resize(kLeafVertices, vertices.front());
        bvh_.leaf_vertices.insert(bvh_.leaf_vertices.end(), vertices.begin(), vertices.end());
        link(parent, kLeafBit | index);
    }

    const Topology& topology_;
    BinaryTree& tree_;
    Collapse collapse_;
    Bvh bvh_;
};

Bvh build_in_arena(const Topology& topology, std::span<const vec3> positions, SplitMethod split) {
    BinaryTree tree = build_binary_tree(topology, positions, split);
    Bvh bvh = Layout(topology, tree).build();
    for (std::uint32_t leaf = 0; leaf < bvh.leaves.size(); ++leaf) refit_leaf(bvh, leaf, positions);
    for (auto node = static_cast<std::uint32_t>(bvh.nodes.size()); node-- > 0;)
        refit_node(bvh, node);
    return bvh;
}

}  // namespace

Bvh build_bvh(const Topology& topology, std::span<const vec3> positions,
              const BuildConfig& config) {
    if (topology.triangles.size() > kMaxTriangles) {
        throw Error(ExitCode::kLimit, fmt::format("{} triangles are more than a tree can hold ({})",
                                                  topology.triangles.size(), kMaxTriangles));
    }
    return ThreadArena(config.threads).execute([&] {
        return build_in_arena(topology, positions, config.split);
    });
}

}  // namespace morphray
