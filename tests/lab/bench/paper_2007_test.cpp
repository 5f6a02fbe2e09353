// The tracer of the paper, whose arithmetic differs from the program's.
#include <gtest/gtest.h>

#include <vector>

#include "common/bvh/box.h"
#include "lab/bench/peer_tree.h"
#include "tests/lab/bench/star_works.h"

namespace mray::bench {
namespace {

bool is_inside(vec3 p, const PeerNode& node) {
    for (int axis = 0; axis < 3; ++axis) {
        if (p[axis] < node.lower[axis] || p[axis] > node.upper[axis]) return false;
    }
    return true;
}

/// Marks the triangles below a node, all of which must be in its box.
void visit(const PeerTree& tree, std::uint32_t index, std::vector<int>& seen) {
    const PeerNode& node = tree.nodes[index];
    if (node.count == 0) {
        for (const std::uint32_t child : {node.first, node.first + 1}) {
            EXPECT_TRUE(is_inside(tree.nodes[child].lower, node));
            EXPECT_TRUE(is_inside(tree.nodes[child].upper, node));
            visit(tree, child, seen);
        }
        return;
    }
    for (std::uint32_t i = node.first; i < node.first + node.count; ++i) {
        const PeerTriangle& t = tree.triangles[i];
        for (const vec3& p : {t.a, t.b, t.c}) EXPECT_TRUE(is_inside(p, node));
        ++seen[t.prim_id];
    }
}

TEST(BuildPeerTree, HasEveryFiniteTriangleInOneLeaf) {
    for (const test::NamedScene& named : test::adversarial_scenes()) {
        const Topology& topology = named.scene.topology();
        const PeerTree tree = build_paper_tree(topology, named.scene.positions());
        std::vector<int> seen(topology.triangles.size());
        if (!tree.nodes.empty()) visit(tree, 0, seen);
        for (std::size_t id = 0; id < seen.size(); ++id) {
            const uvec3 t = topology.triangles[id];
            bool finite = true;
            for (int i = 0; i < 3; ++i) {
                finite = finite && is_finite_vertex(named.scene.positions()[t[i]]);
            }
            EXPECT_EQ(seen[id], finite ? 1 : 0) << named.name << ' ' << id;
        }
    }
}

class Paper2007 : public StarWorks {
protected:
    TraceAnswers trace(const TraceWork& work) const {
        const PeerTree tree = build_paper_tree(scene_.topology(), scene_.positions());
        const Tracer tracer = paper_tracer(tree, work);
        tracer.trace(work.whole());
        return tracer.answers();
    }
};

// Rays within rounding of an edge may choose its other side.
constexpr std::uint64_t kFew = 4;

TEST_F(Paper2007, FindsTheClosestHits) {
    EXPECT_LE(count_mismatches(primary_, expected(primary_), trace(primary_)), kFew);
}

TEST_F(Paper2007, FindsOccludedRays) {
    const TraceWork shadow = secondary(WorkKind::kShadow);
    EXPECT_LE(count_mismatches(shadow, expected(shadow), trace(shadow)), kFew);
}

TEST_F(Paper2007, SeesAllSidesFromInside) {
    ViewSpec view;
    view.width = view.height = 64;
    view.fov = 140;
    view.eye = {0, 0, 0};
    view.target = {0.1, 0.2, -1};
    const TraceWork work = make_primary_work(
        make_image_params(view, bounds_of(scene_.world_positions()), scene_.space()));
    const TraceAnswers answers = trace(work);
    EXPECT_EQ(count_hits(work, answers), work.active_count);
    EXPECT_LE(count_mismatches(work, expected(work), answers), kFew);
}

}  // namespace
}  // namespace mray::bench
