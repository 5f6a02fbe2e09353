#include "common/update/restructure.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "common/bvh/builder/bvh_builder.h"
#include "common/update/tree_updater.h"
#include "cpu/refit/refit.h"
#include "tests/support/motions.h"
#include "tests/support/test_scene.h"
#include "tests/support/tree_check.h"

namespace mray {
namespace {

using namespace test;

const std::vector<std::string> kSound;

/// Positions of a shape in scene space.
std::vector<vec3> snapped(const Shape& shape) {
    std::vector<vec3> positions;
    for (const dvec3& p : shape.positions) positions.push_back(snap_point(vec3(p)));
    return positions;
}

constexpr int kBodies = 60;

/// Bodies of 80 triangles at random places; the seed chooses these.
Shape bodies(std::uint64_t seed) {
    Random random(seed);
    Shape all;
    for (int i = 0; i < kBodies; ++i) {
        Shape body = shapes::icosphere(1);
        const dvec3 centre = random.exact_point(0.9 * kSceneExtent);
        for (dvec3& p : body.positions) p = centre + 0.03 * kSceneExtent * p;
        all.append(body);
    }
    return all;
}

TEST(Restructure, MakesATreeAsGoodAsABuildOfBodiesThatMove) {
    const Topology topology = TestScene(bodies(0)).topology();
    Bvh bvh = build_bvh(topology, snapped(bodies(0)));
    BuiltAreas areas = built_areas(bvh);
    for (std::uint64_t step = 1; step < 12; ++step) {
        const std::vector<vec3> positions = snapped(bodies(step));
        cpu::refit(bvh, positions);
        const double degraded = tree_cost(bvh.nodes);
        EXPECT_GT(restructure(topology, positions, 1, 1, bvh, areas), 0u);
        ASSERT_EQ(check_bvh(bvh, topology, positions), kSound) << step;
        const double fresh = tree_cost(build_bvh(topology, positions).nodes);
        EXPECT_GT(degraded, 1.5 * fresh);
        EXPECT_LT(tree_cost(bvh.nodes), 1.15 * fresh) << step;
    }
}

TEST(Restructure, InSlicesTakesTheWorstPartsFirstAndComesAsFar) {
    const TestScene scene = random_soup(6000, 0.02, 3);
    Bvh whole = build_bvh(scene.topology(), scene.positions());
    BuiltAreas areas = built_areas(whole);
    Bvh slices = whole;
    BuiltAreas slice_areas = areas;
    // The triangles of a slab go their own ways, about a fifth.
    std::vector<vec3> positions = scene.positions();
    std::vector<float> along;
    for (const vec3& p : positions) along.push_back(p.x);
    const auto fifth = along.begin() + static_cast<std::ptrdiff_t>(along.size() / 5);
    std::nth_element(along.begin(), fifth, along.end());
    Random random(7);
    for (std::size_t i = 0; i < positions.size(); i += 3) {
        if (positions[i].x > *fifth) continue;
        const vec3 way = random.point(0.4 * kSceneExtent);
        for (std::size_t k = 0; k < 3; ++k) positions[i + k] = snap_point(positions[i + k] + way);
    }
    cpu::refit(whole, positions);
    cpu::refit(slices, positions);
    const double degraded = tree_cost(whole.nodes);
    const std::size_t at_once = restructure(scene.topology(), positions, 1, 1, whole, areas);
    const double cured = tree_cost(whole.nodes);
    EXPECT_LT(cured, 0.7 * degraded);
    double last = degraded;
    int count = 0;
    for (; count < 100; ++count) {
        const std::size_t parts =
            restructure(scene.topology(), positions, 1, 0.05, slices, slice_areas);
        if (parts == 0) break;
        ASSERT_EQ(check_bvh(slices, scene.topology(), positions), kSound) << count;
        if (count == 0) {
            EXPECT_LT(parts, at_once / 2);
            EXPECT_LT(tree_cost(slices.nodes), 0.9 * degraded);
        }
        last = tree_cost(slices.nodes);
    }
    EXPECT_GT(count, 1);
    EXPECT_LT(last - cured, 0.2 * (degraded - cured));
}

/// Adds a triangle with a corner at this place and sides of `size`.
void add_triangle(Shape& shape, const dvec3& place, double size) {
    shape.add_triangle(place, place + dvec3(size, 0, 0), place + dvec3(0, size, 0));
}

TEST(Restructure, ThatNeedsFewerLeavesMovesTheLastOnesIntoTheirPlaces) {
    // Pairs of triangles, far from each other, have a leaf each. Then all first ones meet, and all
    // second ones elsewhere, which takes fewer leaves.
    constexpr int kPairs = 40;
    constexpr double kFar = 0.02 * kSceneExtent;
    constexpr double kSize = 1e-4 * kSceneExtent;
    // Others stay on one side, so that the free places are the last ones, or others.
    for (const double side : {-10 * kFar, 10 * kFar}) {
        Shape before_shape;
        Shape after_shape;
        for (int i = 0; i < kPairs; ++i) {
            for (const int k : {0, 1}) {
                add_triangle(before_shape, {kFar * i, kSize * k, 0}, kSize);
                add_triangle(after_shape, {kSize * i, 20 * kFar * k, 0}, kSize);
            }
        }
        for (int i = 0; i < 3 * kPairs; ++i) {
            for (Shape* const shape : {&before_shape, &after_shape})
                add_triangle(*shape, {kFar * (i % kPairs), side, kFar * (i / kPairs)}, kSize);
        }
        const Topology topology = TestScene(before_shape).topology();
        const std::vector<vec3> apart = snapped(before_shape);
        const std::vector<vec3> together = snapped(after_shape);
        Bvh bvh = build_bvh(topology, apart);
        BuiltAreas areas = built_areas(bvh);
        const std::size_t before = bvh.leaves.size();
        cpu::refit(bvh, together);
        ASSERT_GT(restructure(topology, together, 1, 1, bvh, areas), 0u);
        EXPECT_LT(bvh.leaves.size(), before);
        EXPECT_EQ(check_bvh(bvh, topology, together), kSound);
        // One of both has pads.
        const BuiltAreas expected = built_areas(bvh);
        ASSERT_EQ(areas.leaves.size(), expected.leaves.size());
        for (std::size_t i = 0; i < areas.leaves.size(); ++i)
            EXPECT_NEAR(areas.leaves[i] / expected.leaves[i], 1, 0.01) << i;
        // A refit finds the vertices of moved leaves.
        cpu::refit(bvh, apart);
        EXPECT_EQ(check_bvh(bvh, topology, apart), kSound);
    }
}

TEST(Restructure, LeavesASoundTreeAsItIs) {
    const TestScene scene = torus(40, 20);
    Bvh bvh = build_bvh(scene.topology(), scene.positions());
    BuiltAreas areas = built_areas(bvh);
    const std::uint64_t before = bvh_hash(bvh);
    EXPECT_EQ(restructure(scene.topology(), scene.positions(), 1, 1, bvh, areas), 0u);
    EXPECT_EQ(bvh_hash(bvh), before);
}

TEST(Restructure, DoesNotMindTrianglesThatGrow) {
    const TestScene scene = torus(40, 20);
    std::vector<vec3> small = scene.positions();
    for (vec3& p : small) p = snap_point(0.25f * p);
    Bvh bvh = build_bvh(scene.topology(), small);
    BuiltAreas areas = built_areas(bvh);
    cpu::refit(bvh, scene.positions());
    EXPECT_EQ(restructure(scene.topology(), scene.positions(), 16, 1, bvh, areas), 0u);
}

TEST(Restructure, KeepsEveryInvariantOnEveryMotion) {
    std::size_t edits = 0;
    std::size_t kept = 0;
    for (const Motion& motion : hard_motions()) {
        const std::vector<vec3>& start = motion.poses[motion.build_at];
        Bvh bvh = build_bvh(motion.topology, start);
        BuiltAreas areas = built_areas(bvh);
        for (std::size_t pose = 0; pose < motion.poses.size(); ++pose) {
            cpu::refit(bvh, motion.poses[pose]);
            ASSERT_EQ(check_bvh(bvh, motion.topology, motion.poses[pose]), kSound)
                << motion.name << ", pose " << pose;
            const Bvh before = bvh;
            const std::size_t parts =
                restructure(motion.topology, motion.poses[pose], 1, 1, bvh, areas);
            ASSERT_EQ(check_bvh(bvh, motion.topology, motion.poses[pose]), kSound)
                << motion.name << ", pose " << pose;
            EXPECT_EQ(parts == 0, bvh_hash(bvh) == bvh_hash(before)) << motion.name;
            ++(parts > 0 ? edits : kept);
            EXPECT_EQ(areas.leaves.size(), bvh.leaves.size());
            EXPECT_EQ(areas.nodes.size(), bvh.nodes.size());
        }
    }
    EXPECT_GT(edits, 10u);
    EXPECT_GT(kept, 10u);
}

TEST(Restructure, OfNoTrianglesAndOfOneLeafDoesNothing) {
    for (const std::uint32_t count : {0u, 1u, 4u}) {
        const TestScene scene = random_soup(count, 0.1, 7);
        Bvh bvh = build_bvh(scene.topology(), scene.positions());
        BuiltAreas areas = built_areas(bvh);
        std::vector<vec3> apart = scene.positions();
        for (std::size_t i = 0; i < apart.size(); ++i)
            apart[i].x = (i % 2 == 0 ? 1.0f : -1.0f) * kSceneExtent;
        cpu::refit(bvh, apart);
        EXPECT_EQ(restructure(scene.topology(), apart, 1, 1, bvh, areas), 0u);
    }
}

}  // namespace
}  // namespace mray
