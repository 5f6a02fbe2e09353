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
        check_shape();
        if (!problems_.empty()) return std::move(problems_);
        for (std::uint32_t node = 0; node < bvh_.nodes.size(); ++node) check_node(node);
        for (std::uint32_t leaf = 0; leaf < bvh_.leaves.size(); ++leaf) check_leaf(leaf);
        check_all_seen();
        return std::move(problems_);
    }

private:
    /// Returns `ok`, and reports the problem if it is false.
    template <class... Args>
    bool expect(bool ok, fmt::format_string<Args...> format, Args&&... args) {
        if (!ok && problems_.size() < limit_)
            problems_.push_back(fmt::format(format, std::forward<Args>(args)...));
        return ok;
    }

    /// Checks array sizes and levels, which the other checks index by.
    void check_shape() {
        const auto& levels = bvh_.level_begin;
        expect(!bvh_.nodes.empty() && levels.size() >= 2 && levels.front() == 0 &&
                   levels.back() == bvh_.nodes.size(),
               "levels do not cover the nodes");
        for (std::size_t i = 1; i < levels.size(); ++i)
            expect(levels[i] > levels[i - 1], "level {} is empty", i - 1);
        expect(bvh_.depth() <= kMaxDepth, "depth {} is above {}", bvh_.depth(), kMaxDepth);
        expect(bvh_.node_parents.size() == bvh_.nodes.size() &&
                   bvh_.leaf_parents.size() == bvh_.leaves.size() &&
                   bvh_.leaf_vertices.size() == bvh_.leaves.size() * kLeafVertices,
               "parents or leaf vertices have the wrong size");
        expect(bvh_.triangle_count == topology_.triangles.size(),
               "{} triangles in the tree, {} in the scene", bvh_.triangle_count,
               topology_.triangles.size());
    }

    std::uint32_t level_of(std::uint32_t node) const {
        std::uint32_t level = 0;
        while (bvh_.level_begin[level + 1] <= node) ++level;
        return level;
    }

    void check_node(std::uint32_t index) {
        const Node& node = bvh_.nodes[index];
        expect(index > 0 || bvh_.node_parents[0] == kNoParent, "the root has a parent");
        bool ended = false;
        for (std::uint32_t slot = 0; slot < kWidth; ++slot) {
            const std::uint32_t child = child_of(node, slot);
            const Box box = slot_box(node, slot);
            if (child == kEmptyChild) {
                ended = true;
                expect(box == Box(), "node {} slot {} is empty, its box is not", index, slot);
                continue;
            }
            expect(!ended, "node {} slot {} is used after an empty one", index, slot);
            const std::uint32_t place = leaf_of(child);
            const auto& parents = is_leaf(child) ? bvh_.leaf_parents : bvh_.node_parents;
            if (!expect(place < parents.size() && parents[place] == parent_at(index, slot),
                        "node {} slot {}: its child does not refer back", index, slot))
                continue;
            expect(is_leaf(child) || level_of(child) == level_of(index) + 1,
                   "node {} is not one level below its parent", child);
            expect(box == (is_leaf(child) ? padded(bounds_of_leaf(place))
                                          : node_box(bvh_.nodes[child])),
                   "node {} slot {}: the box is not the bounds of its child", index, slot);
        }
    }

    /// From the scene's vertices, not from the leaf's copies.
    Box bounds_of_leaf(std::uint32_t leaf) const {
        Box box;
        for (const std::uint32_t prim : bvh_.leaves[leaf].prim_id) {
            if (prim >= topology_.triangles.size()) continue;
            const uvec3 t = topology_.triangles[prim];
            for (const std::uint32_t vertex : {t.x, t.y, t.z})
                if (is_finite_vertex(positions_[vertex])) box.extend(positions_[vertex]);
        }
        return box;
    }

    void check_leaf(std::uint32_t index) {
        const Leaf& leaf = bvh_.leaves[index];
        const std::uint32_t count = corner_triangle_count(leaf.vertex[0].corners);
        expect(count > 0 && count <= kLeafTriangles, "leaf {} holds {} triangles", index, count);
        for (std::uint32_t i = 0; i < kLeafTriangles; ++i) {
            expect(corner_triangle_count(leaf.vertex[i].corners) == count, "leaf {}: counts differ",
                   index);
            if (i >= count) {
                expect(leaf.prim_id[i] == kNoPrim, "leaf {} slot {} is unused, but has an id",
                       index, i);
                continue;
            }
            expect(i == 0 || leaf.prim_id[i] > leaf.prim_id[i - 1], "leaf {}: ids do not ascend",
                   index);
            check_triangle(index, i);
        }
    }

    void check_triangle(std::uint32_t index, std::uint32_t i) {
        const Leaf& leaf = bvh_.leaves[index];
        const std::uint32_t prim = leaf.prim_id[i];
        if (!expect(prim < topology_.triangles.size(),
                    "leaf {} names triangle {}, which is not in the scene", index, prim))
            return;
        ++seen_[prim];
        const uvec3 t = topology_.triangles[prim];
        const std::uint32_t expected[] = {t.x, t.y, t.z};
        for (std::uint32_t k = 0; k < 3; ++k) {
            const std::uint32_t slot = corner(leaf.vertex[i].corners, k);
            const std::uint32_t* vertices = vertices_of(bvh_.leaf_vertices, index).data();
            if (!expect(slot < kLeafVertices && vertices[slot] == expected[k],
                        "leaf {}, triangle {}: corner {} is another vertex", index, prim, k))
                continue;
            // Bits, not values. NOLINTNEXTLINE(bugprone-suspicious-memory-comparison)
            expect(std::memcmp(&leaf.vertex[slot].x, &positions_[expected[k]], sizeof(vec3)) == 0,
                   "leaf {}, triangle {}: corner {} is elsewhere", index, prim, k);
        }
    }

    /// Each triangle is in one leaf, or repeats one that is.
    void check_all_seen() {
        for (const RepeatedTriangle& repeated : bvh_.repeated) {
            if (expect(repeated.prim_id < seen_.size() && repeated.first < repeated.prim_id &&
                           seen_[repeated.first] > 0 &&
                           topology_.triangles[repeated.first] ==
                               topology_.triangles[repeated.prim_id],
                       "triangle {} does not repeat triangle {}", repeated.prim_id, repeated.first))
                ++seen_[repeated.prim_id];
        }
        for (std::size_t prim = 0; prim < seen_.size(); ++prim)
            expect(seen_[prim] == 1, "triangle {} is in {} leaves", prim, seen_[prim]);
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
