#include "tests/support/tree_check.h"

#include <fmt/format.h>

#include <cstring>

#include "common/bvh/box.h"

namespace mray::test {
namespace {

class Checker {
public:
    Checker(const Bvh& bvh, const Topology& topology, std::span<const vec3> positions,
            std::size_t limit)
        : bvh_(bvh),
          topology_(topology),
          positions_(positions),
          limit_(limit),
          seen_(topology.triangles.size()) {}

    std::vector<std::string> run() {
        if (!check_shape()) return std::move(problems_);
        for (std::uint32_t node = 0; node < bvh_.nodes.size(); ++node) check_node(node);
        for (std::uint32_t leaf = 0; leaf < bvh_.leaves.size(); ++leaf) check_leaf(leaf);
        check_all_seen();
        return std::move(problems_);
    }

private:
    template <class... Args>
    void report(fmt::format_string<Args...> format, Args&&... args) {
        if (problems_.size() < limit_)
            problems_.push_back(fmt::format(format, std::forward<Args>(args)...));
    }

    /// Checks array sizes and levels, which the other checks index by.
    bool check_shape() {
        const auto& levels = bvh_.level_begin;
        if (bvh_.nodes.empty() || levels.size() < 2 || levels.front() != 0 ||
            levels.back() != bvh_.nodes.size()) {
            report("levels do not cover the nodes");
        }
        for (std::size_t i = 1; i < levels.size(); ++i) {
            if (levels[i] <= levels[i - 1]) report("level {} is empty", i - 1);
        }
        if (bvh_.depth() > kMaxDepth) report("depth {} is above {}", bvh_.depth(), kMaxDepth);
        if (bvh_.node_parents.size() != bvh_.nodes.size() ||
            bvh_.leaf_parents.size() != bvh_.leaves.size() ||
            bvh_.leaf_vertices.size() != bvh_.leaves.size() * kLeafVertices) {
            report("parents or leaf vertices have the wrong size");
        }
        if (bvh_.triangle_count != topology_.triangles.size()) {
            report("{} triangles in the tree, {} in the scene", bvh_.triangle_count,
                   topology_.triangles.size());
        }
        return problems_.empty();
    }

    std::uint32_t level_of(std::uint32_t node) const {
        std::uint32_t level = 0;
        while (bvh_.level_begin[level + 1] <= node) ++level;
        return level;
    }

    void check_node(std::uint32_t index) {
        const Node& node = bvh_.nodes[index];
        if (index == 0 && bvh_.node_parents[0] != kNoParent) report("the root has a parent");
        bool ended = false;
        for (std::uint32_t slot = 0; slot < kWidth; ++slot) {
            const std::uint32_t child = node.child[slot];
            const Box box = slot_box(node, slot);
            if (child == kEmptyChild) {
                ended = true;
                if (!(box == Box()))
                    report("node {} slot {} is empty, its box is not", index, slot);
                continue;
            }
            if (ended) report("node {} slot {} is used after an empty one", index, slot);
            const std::uint32_t reference = index * kWidth + slot;
            if ((child & kLeafBit) != 0) {
                check_leaf_link(child & ~kLeafBit, reference, box);
            } else {
                check_node_link(index, child, reference, box);
            }
        }
    }

    void check_node_link(std::uint32_t index, std::uint32_t child, std::uint32_t reference,
                         const Box& box) {
        if (child >= bvh_.nodes.size() || bvh_.node_parents[child] != reference) {
            report("node {} slot {} refers to node {}, which does not refer back", index,
                   reference % kWidth, child);
            return;
        }
        if (level_of(child) != level_of(index) + 1)
            report("node {} is not one level below its parent", child);
        if (!(box == node_box(bvh_.nodes[child]))) {
            report("node {} slot {}: the box is not the bounds of node {}", index,
                   reference % kWidth, child);
        }
    }

    void check_leaf_link(std::uint32_t leaf, std::uint32_t reference, const Box& box) {
        if (leaf >= bvh_.leaves.size() || bvh_.leaf_parents[leaf] != reference) {
            report("slot {} of node {} refers to leaf {}, which does not refer back",
                   reference % kWidth, reference / kWidth, leaf);
            return;
        }
        // The bounds come from the scene's vertices, not from the leaf's copies.
        Box tight;
        for (const std::uint32_t prim : bvh_.leaves[leaf].prim_id) {
            if (prim >= topology_.triangles.size()) continue;
            const uvec3 t = topology_.triangles[prim];
            for (const std::uint32_t vertex : {t.x, t.y, t.z}) {
                if (is_finite_vertex(positions_[vertex])) tight.extend(positions_[vertex]);
            }
        }
        if (!(box == padded(tight))) {
            report("node {} slot {}: the box is not the padded bounds of leaf {}",
                   reference / kWidth, reference % kWidth, leaf);
        }
    }

    void check_leaf(std::uint32_t index) {
        const Leaf& leaf = bvh_.leaves[index];
        const std::uint32_t count = corner_triangle_count(leaf.vertex[0].corners);
        if (count == 0 || count > kLeafTriangles)
            report("leaf {} holds {} triangles", index, count);
        for (std::uint32_t i = 0; i < kLeafTriangles; ++i) {
            if (corner_triangle_count(leaf.vertex[i].corners) != count)
                report("leaf {}: counts differ", index);
            if (i >= count) {
                if (leaf.prim_id[i] != kNoPrim)
                    report("leaf {} slot {} is unused, but has an id", index, i);
                continue;
            }
            if (i > 0 && leaf.prim_id[i] <= leaf.prim_id[i - 1])
                report("leaf {}: ids do not ascend", index);
            check_triangle(index, i);
        }
    }

    void check_triangle(std::uint32_t index, std::uint32_t i) {
        const Leaf& leaf = bvh_.leaves[index];
        const std::uint32_t prim = leaf.prim_id[i];
        if (prim >= topology_.triangles.size()) {
            report("leaf {} names triangle {}, which is not in the scene", index, prim);
            return;
        }
        ++seen_[prim];
        const uvec3 t = topology_.triangles[prim];
        const std::uint32_t expected[] = {t.x, t.y, t.z};
        for (std::uint32_t k = 0; k < 3; ++k) {
            const std::uint32_t slot = corner(leaf.vertex[i].corners, k);
            if (slot >= kLeafVertices ||
                bvh_.leaf_vertices[std::size_t{index} * kLeafVertices + slot] != expected[k]) {
                report("leaf {}, triangle {}: corner {} is another vertex", index, prim, k);
                // Bits, not values. NOLINTNEXTLINE(bugprone-suspicious-memory-comparison)
            } else if (std::memcmp(&leaf.vertex[slot].x, &positions_[expected[k]], sizeof(vec3)) !=
                       0) {
                report("leaf {}, triangle {}: corner {} is elsewhere", index, prim, k);
            }
        }
    }

    /// Each triangle is in one leaf, or repeats one that is.
    void check_all_seen() {
        for (const RepeatedTriangle& repeated : bvh_.repeated) {
            if (repeated.prim_id >= seen_.size() || repeated.first >= repeated.prim_id ||
                seen_[repeated.first] == 0 ||
                topology_.triangles[repeated.first] != topology_.triangles[repeated.prim_id]) {
                report("triangle {} does not repeat triangle {}", repeated.prim_id, repeated.first);
                continue;
            }
            ++seen_[repeated.prim_id];
        }
        for (std::size_t prim = 0; prim < seen_.size(); ++prim) {
            if (seen_[prim] > 1) report("triangle {} is in {} leaves", prim, seen_[prim]);
            if (seen_[prim] == 0) report("triangle {} is in no leaf", prim);
        }
    }

    const Bvh& bvh_;
    const Topology& topology_;
    std::span<const vec3> positions_;
    std::size_t limit_;
    std::vector<std::uint32_t> seen_;
    std::vector<std::string> problems_;
};

}  // namespace

std::vector<std::string> check_bvh(const Bvh& bvh, const Topology& topology,
                                   std::span<const vec3> positions, std::size_t limit) {
    return Checker(bvh, topology, positions, limit).run();
}

}  // namespace mray::test
