#include "common/bvh/builder/bvh_builder.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "common/bvh/builder/binary_tree.h"
#include "common/bvh/bvh.h"
#include "common/scene/mesh.h"
#include "tests/support/test_scene.h"
#include "tests/support/tree_check.h"

namespace mray {
namespace {

using test::adversarial_scenes;
using test::check_bvh;
using test::NamedScene;
using test::TestScene;

TEST(BvhBuilder, KeepsEveryInvariantOnEveryScene) {
    for (const NamedScene& named : adversarial_scenes()) {
        const TestScene& scene = named.scene;
        const Bvh bvh = build_bvh(scene.topology(), scene.positions());
        EXPECT_EQ(check_bvh(bvh, scene.topology(), scene.positions()), std::vector<std::string>{})
            << named.name;
    }
}

// 400 triangles that are five triangles, in five orders of vertices.
TEST(BvhBuilder, KeepsTheFirstOfTrianglesWithTheSameVertices) {
    for (const NamedScene& named : adversarial_scenes()) {
        if (named.name != "repeated") continue;
        const Bvh bvh = build_bvh(named.scene.topology(), named.scene.positions());
        ASSERT_EQ(bvh.leaves.size(), 1u);
        for (std::uint32_t i = 0; i < kLeafTriangles; ++i)
            EXPECT_EQ(bvh.leaves[0].prim_id[i], i < 5 ? 2 * i : kNoPrim);
        EXPECT_EQ(bvh.triangle_count, 400u);
        EXPECT_EQ(bvh_stats(bvh).triangles_per_leaf, 5);
    }
}

TEST(BvhBuilder, GivesTheSameBytesForEveryTarget) {
    for (const NamedScene& named : adversarial_scenes()) {
        const TestScene& scene = named.scene;
        const auto hash_on = [&](const SimdTarget& target) {
            return bvh_hash(build_bvh(scene.topology(), scene.positions(), {1, target}));
        };
        const std::uint64_t expected = hash_on(best_simd_target());
        for (const SimdTarget& target : supported_simd_targets())
            EXPECT_EQ(hash_on(target), expected) << named.name << ", " << target.name;
    }
}

void expect_same_sound_tree_for_any_threads(const TestScene& scene) {
    const Bvh expected = build_bvh(scene.topology(), scene.positions(), {1});
    EXPECT_EQ(check_bvh(expected, scene.topology(), scene.positions()), std::vector<std::string>{});
    for (const int threads : {2, 3, 4}) {
        const Bvh bvh = build_bvh(scene.topology(), scene.positions(), {threads});
        EXPECT_EQ(bvh_hash(bvh), bvh_hash(expected));
        EXPECT_EQ(bvh.leaf_vertices, expected.leaf_vertices);
        EXPECT_EQ(bvh.leaf_parents, expected.leaf_parents);
        EXPECT_EQ(bvh.node_parents, expected.node_parents);
    }
}

// Around the sizes at which the builder goes from leaves to bins, to tasks, to chunks.
TEST(BvhBuilder, GivesTheSameSoundTreeForAnyNumberOfThreadsAtEverySize) {
    for (const std::uint32_t size : {1u, 5u, 6u, 16u, 17u, 24u, 25u, 64u, 65u, 2047u, 2048u, 4096u,
                                     16383u, 16384u, 16385u, 24576u, 24577u, 40000u}) {
        SCOPED_TRACE(size);
        expect_same_sound_tree_for_any_threads(test::random_soup(size, 0.02, size));
    }
}

// Pairs, more of them than a chunk has.
TEST(BvhBuilder, GivesTheSameSoundTreeOfQuadranglesForAnyNumberOfThreads) {
    expect_same_sound_tree_for_any_threads(test::torus(200, 101));
}

TEST(BvhBuilder, DoesNotDependOnTheOrderOfTrianglesWithoutTies) {
    const TestScene scene = test::random_soup(3000, 0.1, 9);
    std::vector<uvec3> reversed = scene.topology().triangles;
    std::reverse(reversed.begin(), reversed.end());
    const TestScene mirrored(scene.world_positions(), reversed);
    const BvhStats a = bvh_stats(build_bvh(scene.topology(), scene.positions()));
    const BvhStats b = bvh_stats(build_bvh(mirrored.topology(), mirrored.positions()));
    EXPECT_EQ(a.sah_cost, b.sah_cost);
    EXPECT_EQ(a.node_count, b.node_count);
    EXPECT_EQ(a.leaf_count, b.leaf_count);
}

std::uint32_t binary_height(const TestScene& scene) {
    const BinaryTree tree = build_binary_tree(scene.topology(), scene.positions());
    return tree.nodes.empty() ? 0 : tree.nodes.front().height;
}

/// Triangles in one place near the origin, and others towards it, each smaller than the one before:
/// splits peel these off a few at a time.
TestScene peeled_triangles(std::uint32_t peeled, std::uint32_t rest) {
    std::vector<vec3> positions;
    std::vector<uvec3> triangles;
    for (std::uint32_t i = 0; i < peeled + rest; ++i) {
        const float x = std::ldexp(1.0f, -static_cast<int>(std::min(i, peeled)) / 2);
        for (const vec3 corner : {vec3(x, 0, 0), vec3(x, 0.2f * x, 0), vec3(x, 0, 0.2f * x)})
            positions.push_back(corner);
        triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
    }
    return {positions, triangles};
}

TEST(BvhBuilder, BoundsTheDepthWhereSplitsPeelFewTrianglesAtATime) {
    const TestScene scene = peeled_triangles(120, 100000);
    const Bvh bvh = build_bvh(scene.topology(), scene.positions());
    EXPECT_EQ(bvh.depth(), kMaxDepth);
    EXPECT_EQ(check_bvh(bvh, scene.topology(), scene.positions()), std::vector<std::string>{});
    EXPECT_LE(binary_height(scene), kMaxBinaryHeight);
}

TEST(BvhBuilder, FillsNodesAndLeavesOnAnOrdinaryMesh) {
    const TestScene scene = test::torus(200, 100);
    const BvhStats stats = bvh_stats(build_bvh(scene.topology(), scene.positions()));
    EXPECT_GT(stats.children_per_node, 8);
    EXPECT_GT(stats.triangles_per_leaf, 9);
    EXPECT_LE(stats.vertices_per_leaf, 16);
}

TEST(BvhBuilder, OpensPairsThatCoincide) {
    // The halves of one square again and again, then with vertices of their own.
    const std::vector<vec3> corners = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
    std::vector<vec3> own;
    std::vector<uvec3> same, apart;
    for (std::uint32_t i = 0; i < 40; ++i) {
        own.insert(own.end(), corners.begin(), corners.end());
        for (const uvec3 half : {uvec3(0, 1, 2), uvec3(0, 2, 3)}) {
            same.push_back(half);
            apart.push_back(half + uvec3(4 * i));
        }
    }
    const TestScene repeated(corners, same);
    const Bvh kept = build_bvh(repeated.topology(), repeated.positions());
    EXPECT_EQ(check_bvh(kept, repeated.topology(), repeated.positions()),
              std::vector<std::string>{});
    EXPECT_EQ(kept.repeated.size(), 78u);
    const TestScene coincident(own, apart);
    const Bvh all = build_bvh(coincident.topology(), coincident.positions());
    EXPECT_EQ(check_bvh(all, coincident.topology(), coincident.positions()),
              std::vector<std::string>{});
    EXPECT_EQ(all.repeated.size(), 0u);
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
    const TestScene scene(positions, triangles);
    const Bvh bvh = build_bvh(scene.topology(), scene.positions());
    EXPECT_EQ(check_bvh(bvh, scene.topology(), scene.positions()), std::vector<std::string>{});
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
    const TestScene scene(positions, triangles);
    const BvhStats stats = bvh_stats(build_bvh(scene.topology(), scene.positions()));
    EXPECT_EQ(stats.leaf_count, 2u);
    // Half areas: root 10 x 1, leaves 1 x 1: (10 + 16 * 1 + 16 * 1) / 10; all boxes reach out to
    // each side by a pad of at most 2^-22 of 1 and 2^-23 of 10.
    const double pad = 0x1p-22 + 10 * 0x1p-23;
    EXPECT_LE(stats.sah_cost, 4.2 * (1 + 8 * pad));
    EXPECT_GE(stats.sah_cost, 4.2 * (1 - 8 * pad));
}

TEST(CountDegenerate, CountsBothKinds) {
    for (const NamedScene& named : adversarial_scenes()) {
        const DegenerateCount count =
            count_degenerate(named.scene.topology(), named.scene.positions());
        if (named.name == "one point" || named.name == "collinear") {
            EXPECT_EQ(count.zero_area, 100u);
        } else if (named.name == "not finite") {
            // One vertex of the first twelve (valence 5) and two later ones (valence 6), not
            // adjacent.
            EXPECT_EQ(count.left_out, 5u + 6u + 6u);
        } else if (named.name == "torus") {
            EXPECT_EQ(count.zero_area + count.left_out, 0u);
        }
    }
}

}  // namespace
}  // namespace mray
