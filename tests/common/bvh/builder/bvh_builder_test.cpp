#include "common/bvh/builder/bvh_builder.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <vector>

#include "common/base/aligned_vector.h"
#include "common/bvh/builder/binary_tree.h"
#include "common/bvh/builder/split.h"
#include "common/bvh/bvh.h"
#include "common/scene/mesh.h"
#include "cpu/reference/scalar_tracer.h"
#include "tests/support/test_scene.h"
#include "tests/support/tree_check.h"

namespace mray {
namespace {

using test::adversarial_scenes;
using test::NamedScene;
using test::Random;
using test::Shape;
using test::TestScene;

Bvh build(const TestScene& scene, const BuildConfig& config = {}) {
    return build_bvh(scene.topology(), scene.positions(), config);
}

/// Builds a tree that keeps every invariant.
Bvh build_sound(const TestScene& scene, const BuildConfig& config = {}) {
    Bvh bvh = build(scene, config);
    EXPECT_EQ(test::check_bvh(bvh, scene.topology(), scene.positions()),
              std::vector<std::string>{});
    return bvh;
}

TEST(BvhBuilder, KeepsEveryInvariantOnEveryScene) {
    for (const NamedScene& named : adversarial_scenes()) {
        SCOPED_TRACE(named.name);
        build_sound(named.scene);
    }
}

TEST(BvhBuilder, KeepsTheFirstOfTrianglesWithTheSameVertices) {
    // 400 triangles that are five triangles, in five orders of vertices.
    const uvec3 five[] = {{0, 1, 2}, {2, 3, 0}, {1, 2, 0}, {0, 2, 1}, {0, 2, 3}};
    std::vector<uvec3> triangles;
    for (std::uint32_t i = 0; i < 400; ++i) triangles.push_back(five[i / 2 % std::size(five)]);
    const Bvh bvh =
        build_sound({{{-1, -1, 0}, {1, -1, 0.25f}, {1, 1, 0}, {-1, 1, 0.25f}}, triangles});
    ASSERT_EQ(bvh.leaves.size(), 1u);
    for (std::uint32_t i = 0; i < kLeafTriangles; ++i)
        EXPECT_EQ(bvh.leaves[0].prim_id[i], i < 5 ? 2 * i : kNoPrim);
    EXPECT_EQ(bvh.triangle_count, 400u);
    EXPECT_EQ(bvh_stats(bvh).triangles_per_leaf, 5);
}

TEST(BvhBuilder, GivesTheSameBytesForEveryTarget) {
    std::vector<NamedScene> scenes = adversarial_scenes();
    // More than a chunk.
    scenes.push_back({"large", test::random_soup(40000, 0.02, 1)});
    scenes.push_back({"quadrangles", test::torus(200, 101)});
    for (const NamedScene& named : scenes) {
        const std::uint64_t expected = bvh_hash(build(named.scene, {1, best_simd_target()}));
        for (const SimdTarget& target : supported_simd_targets())
            EXPECT_EQ(bvh_hash(build(named.scene, {1, target})), expected)
                << named.name << ", " << target.name;
    }
}

// Around the sizes at which the builder goes from leaves to bins, to samples, to tasks, to chunks;
// and pairs, more of them than a chunk has.
TEST(BvhBuilder, GivesTheSameSoundTreeForAnyNumberOfThreadsAtEverySize) {
    std::vector<TestScene> scenes = {test::torus(200, 101)};
    for (const std::uint32_t size :
         {1u,    5u,    6u,    16u,   17u,    24u,    25u,    64u,    65u,    1023u,
          1024u, 2047u, 2048u, 4096u, 16383u, 16384u, 16385u, 24576u, 24577u, 40000u})
        scenes.push_back(test::random_soup(size, 0.02, size));
    for (const TestScene& scene : scenes) {
        SCOPED_TRACE(scene.triangle_count());
        const Bvh expected = build_sound(scene, {1});
        for (const int threads : {2, 3, 4}) {
            const Bvh bvh = build(scene, {threads});
            EXPECT_EQ(bvh_hash(bvh), bvh_hash(expected));
            EXPECT_EQ(bvh.leaf_vertices, expected.leaf_vertices);
            EXPECT_EQ(bvh.leaf_parents, expected.leaf_parents);
            EXPECT_EQ(bvh.node_parents, expected.node_parents);
        }
    }
}

TEST(BvhBuilder, DoesNotDependOnTheOrderOfTrianglesWithoutTies) {
    const TestScene scene = test::random_soup(1000, 0.1, 9);  // fewer than a sample
    std::vector<uvec3> reversed = scene.topology().triangles;
    std::reverse(reversed.begin(), reversed.end());
    const BvhStats a = bvh_stats(build(scene));
    const BvhStats b = bvh_stats(build({scene.world_positions(), reversed}));
    EXPECT_EQ(a.sah_cost, b.sah_cost);
    EXPECT_EQ(a.node_count, b.node_count);
    EXPECT_EQ(a.leaf_count, b.leaf_count);
}

TEST(BvhBuilder, DividesASetWhoseSampleCoincides) {
    test::Shape shape;
    for (int i = 0; i < 2000; ++i) {
        const double x = i == 1 ? 9 : 0;
        shape.add_triangle({x, 0, 0}, {x, 1, 0}, {x, 0, 1});
    }
    const Bvh bvh = build_sound(shape);
    EXPECT_TRUE(std::ranges::any_of(bvh.leaves, [](const Leaf& leaf) {
        return leaf.prim_id[0] == 1 && leaf.prim_id[1] == kNoPrim;
    }));
}

TEST(BvhBuilder, BoundsTheDepthWhereSplitsPeelFewTrianglesAtATime) {
    // The last ones are in one place.
    test::Shape shape = test::shapes::progression(120);
    test::Shape last;
    last.positions.assign(shape.positions.end() - 3, shape.positions.end());
    last.triangles = {{0, 1, 2}};
    for (int i = 0; i < 100000; ++i) shape.append(last);
    const TestScene scene = shape;
    EXPECT_EQ(build_sound(scene).depth(), kMaxDepth);
    EXPECT_LE(build_binary_tree(scene.topology(), scene.positions()).nodes.front().height,
              kMaxBinaryHeight);
}

TEST(BvhBuilder, FillsNodesAndLeavesOnAnOrdinaryMesh) {
    const BvhStats stats = bvh_stats(build(test::torus(200, 100)));
    EXPECT_GT(stats.children_per_node, 8);
    EXPECT_GT(stats.triangles_per_leaf, 9);
    EXPECT_LE(stats.vertices_per_leaf, 16);
}

TEST(BvhBuilder, OpensPairsThatCoincide) {
    // The halves of one square again and again, then with vertices of their own.
    const test::Shape square = test::shapes::height_map(1, 1, [](auto...) { return 0; });
    test::Shape apart;
    for (int i = 0; i < 40; ++i) apart.append(square);
    test::Shape same = square;
    for (const uvec3& t : apart.triangles) same.triangles.push_back(t % 4u);
    EXPECT_EQ(build_sound(same).repeated.size(), 80u);
    EXPECT_EQ(build_sound(apart).repeated.size(), 0u);
}

TEST(BvhBuilder, GivesALargeTriangleALeafOfItsOwn) {
    // One has a flat box of 10 x 5; fifteen fill one of 1 x 1 x 3 at its edge. A leaf could hold
    // all.
    std::vector<vec3> positions;
    for (int i = 0; i < 12; ++i)
        positions.emplace_back(9 + 0.5f * static_cast<float>(i % 3), i % 2,
                               static_cast<float>(3 * i) / 11);
    std::vector<uvec3> triangles;
    for (std::uint32_t i = 0; i < 15; ++i) triangles.emplace_back(i % 10, i % 10 + 1, i / 10 + 10);
    for (const vec3 p : {vec3(0, 0, 0), vec3(10, 0, 0), vec3(10, 5, 0)}) positions.push_back(p);
    triangles.emplace_back(12, 13, 14);
    const Bvh bvh = build_sound({positions, triangles});
    ASSERT_EQ(bvh.leaves.size(), 2u);
    const auto sizes = std::minmax({corner_triangle_count(bvh.leaves[0].vertex[0].corners),
                                    corner_triangle_count(bvh.leaves[1].vertex[0].corners)});
    EXPECT_EQ(sizes.first, 1u);
    EXPECT_EQ(sizes.second, 15u);
}

TEST(BvhBuilder, SahCostOfTwoLeavesIsWhatTheFormulaSays) {
    // Two clusters of 16 coinciding unit squares' halves, 9 apart: leaves A and B under one root.
    std::vector<vec3> positions = {{0, 0, 0}, {1, 0, 0},  {0, 1, 0},
                                   {9, 0, 0}, {10, 0, 0}, {9, 1, 0}};
    std::vector<uvec3> triangles(16, uvec3(0, 1, 2));
    triangles.insert(triangles.end(), 16, uvec3(3, 4, 5));
    const BvhStats stats = bvh_stats(build({positions, triangles}));
    EXPECT_EQ(stats.leaf_count, 2u);
    // Half areas: root 10 x 1, leaves 1 x 1: (10 + 16 * 1 + 16 * 1) / 10; all boxes reach out to
    // each side by a pad of at most 2^-22 of 1 and 2^-23 of 10.
    const double pad = 0x1p-22 + 10 * 0x1p-23;
    EXPECT_LE(stats.sah_cost, 4.2 * (1 + 8 * pad));
    EXPECT_GE(stats.sah_cost, 4.2 * (1 - 8 * pad));
}

TEST(CountDegenerate, CountsBothKinds) {
    const TestScene scene({{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {0, 1, 0}, {0, NAN, 0}},
                          {{0, 1, 3}, {0, 1, 2}, {0, 0, 0}, {0, 1, 4}, {4, 4, 4}, {4, 2, 3}});
    const DegenerateCount count = count_degenerate(scene.topology(), scene.positions());
    EXPECT_EQ(count.zero_area, 2u);
    EXPECT_EQ(count.left_out, 3u);
}

/// A row of small boxes, and a large one about the middle of them.
AlignedVector<PrimRef> row_with_a_beam(std::uint32_t count, std::uint32_t beam) {
    AlignedVector<PrimRef> refs;
    for (std::uint32_t id = 0; id < count; ++id) {
        const auto x = static_cast<float>(id);
        refs.push_back(PrimRef({{x, 0, 0}, {x + 1, 1, 1}}, id));
    }
    refs[beam] = PrimRef({{0, -4, -4}, {static_cast<float>(count), 5, 5}}, beam);
    return refs;
}

TEST(SplitByArea, DividesALargeBoxFromTheOthers) {
    const AlignedVector<PrimRef> refs = row_with_a_beam(100, 40);
    AlignedVector<PrimRef> out(refs.size(), PrimRef(Box(), 0));
    const PartSize by_bins = split_binned(refs, out.data());
    float largest = std::numeric_limits<float>::infinity();
    const PartSize by_area = split_by_area(refs, out.data(), refs.size(), by_bins, largest);
    EXPECT_EQ(largest, refs[40].area());
    ASSERT_EQ(by_area.refs, 1u);
    EXPECT_EQ(by_area.triangles, 1u);
    EXPECT_LT(by_area.cost, by_bins.cost);
    // Half areas 1881 and 201, times the triangles and 12.
    EXPECT_EQ(by_area.cost, 1881.0f * 13 + 201.0f * 111);
    EXPECT_EQ(out[0].prim_id(), 40u);
    for (std::uint32_t i = 1; i < 100; ++i) EXPECT_EQ(out[i].prim_id(), i <= 40 ? i - 1 : i);
}

TEST(SplitByArea, LeavesOtherSetsAlone) {
    AlignedVector<PrimRef> refs = row_with_a_beam(100, 40);
    refs[40] = PrimRef({{40, 0, 0}, {41, 1, 1}}, 40);
    AlignedVector<PrimRef> out(refs.size(), PrimRef(Box(), 0));
    const PartSize by_bins = split_binned(refs, out.data());
    const AlignedVector<PrimRef> divided = out;
    float largest = std::numeric_limits<float>::infinity();
    EXPECT_EQ(split_by_area(refs, out.data(), refs.size(), by_bins, largest).refs, 0u);
    EXPECT_EQ(std::memcmp(out.data(), divided.data(), refs.size() * sizeof(PrimRef)), 0);
}

TEST(PairRefs, AreNeighboursThatShareAnEdgeAndFillTheirBox) {
    // A triangle twice, whose second one is half a square; one that is elsewhere; two that meet in
    // an edge of a cube.
    const std::vector<vec3> positions = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0},
                                         {0, 0, 1}, {9, 0, 0}, {9, 1, 0}, {9, 0, 1}};
    Topology topology;
    topology.triangles = {{0, 1, 2}, {0, 1, 2}, {0, 2, 3}, {5, 6, 7}, {0, 1, 3}, {0, 1, 4}};
    topology.vertex_count = static_cast<std::uint32_t>(positions.size());
    AlignedVector<PrimRef> refs(topology.triangles.size(), PrimRef(Box(), 0));
    make_refs(topology, positions, 0, refs);
    ASSERT_EQ(pair_refs(topology, refs), 5u);
    const std::uint32_t ids[] = {0, 1, 3, 4, 5};
    for (std::size_t i = 0; i < 5; ++i) {
        EXPECT_EQ(refs[i].prim_id(), ids[i]) << i;
        EXPECT_EQ(refs[i].triangle_count(), i == 1 ? 2u : 1u) << i;
    }
    EXPECT_EQ(refs[1].box(), (Box{{0, 0, 0}, {1, 1, 0}}));
}

namespace shapes = test::shapes;

// Scenes that were made to be slow: the tree is as deep as any, its memory and the steps of rays
// grow in proportion to the triangles.
struct HostileScene {
    const char* name;
    Shape (*make)(Random& random, int triangles);
};

Shape coincident(int count) {
    Shape shape;
    for (int i = 0; i < count; ++i) shape.add_triangle({0, 0, 0}, {1, 0, 0}, {0, 1, 0});
    return shape;
}

/// Triangles about one axis whose sizes halve again and again: splits that are as uneven as can be.
Shape nested(int count) {
    Shape shape;
    for (int i = 0; i < count; ++i) {
        const double s = std::exp2(-100.0 * i / count);
        const double z = 1e-3 * i / count;
        shape.add_triangle({-s, -s, z}, {s, -s, z}, {0, s, z});
    }
    return shape;
}

Shape scaled(Shape shape, const test::dvec3& by) {
    for (test::dvec3& p : shape.positions) p *= by;
    return shape;
}

const HostileScene kScenes[] = {
    {"repeated",
     [](Random&, int n) {
         Shape shape = coincident(1);
         shape.triangles.resize(static_cast<std::size_t>(n), {0, 1, 2});
         return shape;
     }},
    {"coincident", [](Random&, int n) { return coincident(n); }},
    {"overlapping", [](Random& r, int n) { return shapes::soup(r, n, 1); }},
    {"extents of 1e38",
     [](Random& r, int n) { return scaled(shapes::soup(r, n, 1), test::dvec3(1e38)); }},
    // Beside one triangle of extent 1e38 the others coincide.
    {"outlier",
     [](Random& r, int n) {
         Shape shape = scaled(shapes::soup(r, n - 1, 1), test::dvec3(1e-38));
         shape.add_triangle({-1e38, -1e38, 0}, {1e38, -1e38, 0}, {0, 1e38, 0});
         return shape;
     }},
    {"one plane",
     [](Random& r, int n) {
         return scaled(shapes::soup(r, n, 1 / std::sqrt(n)), {1, 1, 0});
     }},
    {"nested", [](Random&, int n) { return nested(n); }},
    // Triangles far apart share vertices.
    {"scattered",
     [](Random& r, int n) {
         return shapes::shared_vertices(r, n, static_cast<std::uint32_t>(n / 2));
     }},
    {"not finite",
     [](Random&, int n) {
         return scaled(coincident(n), {NAN, NAN, NAN});
     }},
};

/// Bytes of the tree with its tables.
std::uint64_t bytes_of(const Bvh& bvh) {
    return bvh.nodes.size() * (sizeof(Node) + sizeof(std::uint32_t)) +
           bvh.leaves.size() * (sizeof(Leaf) + (kLeafVertices + 1) * sizeof(std::uint32_t));
}

/// The leaves that 64 rays through the scene meet.
std::uint64_t leaves_met(const Bvh& bvh) {
    std::uint64_t met = 0;
    Random random(1);
    for (int i = 0; i < 64; ++i) {
        const vec3 org = snap_point(random.point(3 * kSceneExtent));
        const vec3 dir = canonical_direction(snap_point(random.point(kSceneExtent)) - org);
        cpu::for_each_near_leaf(bvh, {org, 0, dir, kInfiniteT}, kInfiniteT, [&](const Leaf&) {
            ++met;
            return kInfiniteT;
        });
    }
    return met;
}

TEST(HostileScenes, HaveTreesOfBoundedDepthAndMemoryAndLeavesMetInProportion) {
    for (const HostileScene& hostile : kScenes) {
        SCOPED_TRACE(hostile.name);
        std::uint64_t last = 0;
        for (const int count : {4'000, 16'000, 64'000}) {
            Random random(3);
            const TestScene scene = hostile.make(random, count);
            const Bvh bvh = build_sound(scene);
            EXPECT_LE(bvh.depth(), kMaxDepth);
            // A leaf holds any five triangles, and a node two children or more.
            if (bvh.leaves.size() > 1) {
                EXPECT_GE(bvh_stats(bvh).triangles_per_leaf, 1.75);
            }
            EXPECT_LE(bytes_of(bvh), 256u * scene.triangle_count());
            const std::uint64_t met = leaves_met(bvh);
            EXPECT_LE(met, 64u * bvh.leaves.size());
            // Four times the triangles, and some more where the tree is deeper.
            if (last > 0) {
                EXPECT_LE(met, 5 * last);
            }
            last = met;
        }
    }
}

}  // namespace
}  // namespace mray
