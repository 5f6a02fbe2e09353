#include "common/update/restructure.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>
#include <string>
#include <vector>

#include "common/bvh/builder/bvh_builder.h"
#include "common/update/replace_triangles.h"
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

const std::vector<std::string> kNoErrors;

/// A sphere or a ring at a random place of scene space.
Shape random_body(Random& random) {
    Shape body = random.one_in(3) ? shapes::torus(5 + random.below(9), 4 + random.below(5))
                                  : shapes::icosphere(1);
    const dvec3 centre = random.exact_point(0.9 * kSceneExtent);
    const double size = random.real(0.005, 0.1) * kSceneExtent;
    for (dvec3& p : body.positions) p = centre + size * p;
    return body;
}

struct Joined {
    Topology topology;
    std::vector<vec3> positions;
    std::vector<IndexRange> prims;
    std::vector<std::uint32_t> first_vertices;
};

Joined join(const std::vector<Shape>& bodies) {
    Joined joined;
    Shape all;
    for (const Shape& body : bodies) {
        const auto prim = static_cast<std::uint32_t>(all.triangles.size());
        joined.first_vertices.push_back(static_cast<std::uint32_t>(all.positions.size()));
        all.append(body);
        joined.prims.push_back({prim, static_cast<std::uint32_t>(all.triangles.size())});
    }
    joined.topology = TestScene(all).topology();
    for (const dvec3& p : all.positions) joined.positions.push_back(snap_point(vec3(p)));
    return joined;
}

/// The change from `before` to `after`; from[i] is the old number of body i, -1 for a new one.
TopologyChange change_of(const Joined& before, const Joined& after, const std::vector<int>& from) {
    TopologyChange change;
    for (std::size_t i = 0; i < from.size(); ++i) {
        if (from[i] < 0) {
            change.added.push_back(after.prims[i]);
            continue;
        }
        const auto old = static_cast<std::size_t>(from[i]);
        change.keep({.before = before.prims[old],
                     .prim_shift = after.prims[i].begin - before.prims[old].begin,
                     .vertex_shift = after.first_vertices[i] - before.first_vertices[old]});
    }
    return change;
}

TEST(ReplaceTriangles, KeepsEveryInvariantAndTheCost) {
    Random random(31);
    std::vector<Shape> bodies;
    for (int i = 0; i < 150; ++i) bodies.push_back(random_body(random));
    // Two triangles with the same vertices, of which one is in no leaf.
    bodies[7].triangles.push_back(bodies[7].triangles[3]);
    bodies[70].triangles.push_back(bodies[70].triangles[3]);
    Joined joined = join(bodies);
    Bvh bvh = build_bvh(joined.topology, joined.positions);
    BuiltAreas areas = built_areas(bvh);
    for (int step = 0; step < 300; ++step) {
        std::vector<int> from(bodies.size());
        std::iota(from.begin(), from.end(), 0);
        for (std::uint32_t changes = 1 + random.below(3); changes > 0; --changes) {
            const std::ptrdiff_t place = random.below(static_cast<std::uint32_t>(bodies.size()));
            if (const std::uint32_t what = random.below(3); what == 0 && bodies.size() > 100) {
                bodies.erase(bodies.begin() + place);
                from.erase(from.begin() + place);
            } else if (what == 1 && bodies.size() < 200) {
                bodies.insert(bodies.begin() + place, random_body(random));
                from.insert(from.begin() + place, -1);
            } else {
                bodies[static_cast<std::size_t>(place)] = random_body(random);
                from[static_cast<std::size_t>(place)] = -1;
            }
        }
        Joined next = join(bodies);
        const TopologyChange change = change_of(joined, next, from);
        ASSERT_TRUE(replace_triangles(next.topology, next.positions, change, bvh, areas)) << step;
        joined = std::move(next);
        // No vertex has moved. So all boxes are right already, and a refit keeps every bit.
        Bvh refitted = bvh;
        cpu::refit(refitted, joined.positions);
        ASSERT_EQ(bvh_hash(bvh), bvh_hash(refitted)) << step;
        ASSERT_EQ(check_bvh(bvh, joined.topology, joined.positions), kNoErrors) << step;
        ASSERT_EQ(areas.leaves.size(), bvh.leaves.size());
        ASSERT_EQ(areas.nodes.size(), bvh.nodes.size());
        ASSERT_EQ(bvh.triangle_count, joined.topology.triangles.size());
    }
    const Bvh built = build_bvh(joined.topology, joined.positions);
    EXPECT_LT(bvh_stats(bvh).sah_cost, 1.15 * bvh_stats(built).sah_cost);
}

TEST(ReplaceTriangles, RefusesWhatABuildDoesAsFast) {
    Random random(32);
    const std::vector<Shape> few = {random_body(random), random_body(random)};
    const std::vector<Shape> others = {random_body(random), random_body(random), few[1]};
    const Joined before = join(few);
    const Joined after = join(others);
    Bvh bvh = build_bvh(before.topology, before.positions);
    BuiltAreas areas = built_areas(bvh);
    EXPECT_FALSE(replace_triangles(after.topology, after.positions,
                                   change_of(before, after, {-1, -1, 1}), bvh, areas));
    Bvh none = build_bvh(Topology{}, {});
    BuiltAreas none_areas = built_areas(none);
    EXPECT_FALSE(replace_triangles(after.topology, after.positions,
                                   {.kept = {}, .added = after.prims}, none, none_areas));
}

}  // namespace
}  // namespace mray
