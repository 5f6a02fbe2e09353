#include "common/update/replace_triangles.h"

#include <gtest/gtest.h>

#include <numeric>
#include <string>
#include <vector>

#include "common/bvh/builder/bvh_builder.h"
#include "cpu/refit/refit.h"
#include "tests/support/test_scene.h"
#include "tests/support/tree_check.h"

namespace mray {
namespace {

using namespace test;

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
