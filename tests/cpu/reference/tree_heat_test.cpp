#include "cpu/reference/scalar_tracer.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

#include "common/bvh/builder/bvh_builder.h"
#include "common/interop/constants.h"
#include "common/interop/slab.h"
#include "tests/support/test_scene.h"

namespace mray {
namespace {

using namespace test;
using cpu::count_steps;
using cpu::leaf_looseness;

Ray ray_at(vec3 org, vec3 target) {
    return {org, 0, canonical_direction(target - org), kInfiniteT};
}

Bvh tree_of(const std::vector<vec3>& positions, const std::vector<uvec3>& triangles) {
    Topology topology;
    topology.triangles = triangles;
    topology.albedo.resize(triangles.size());
    topology.vertex_count = static_cast<std::uint32_t>(positions.size());
    return build_bvh(topology, positions);
}

TEST(TreeHeat, StepsOfOneLeafAreTheRootAndTheLeafIfItIsMet) {
    const Bvh bvh = tree_of({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}});
    const Ray met = ray_at({0.25f, 0.25f, 5}, {0.25f, 0.25f, 0});
    EXPECT_EQ(count_steps(bvh, met, no_hit()), 2u);
    EXPECT_EQ(count_steps(bvh, ray_at({5, 5, 5}, {5, 5, 6}), no_hit()), 1u);
    // A hit in front of the leaf leaves it out.
    EXPECT_EQ(count_steps(bvh, met, Hit{1, 0, 0, 7}), 1u);
}

TEST(TreeHeat, StepsAreThoseThatNoTraversalCanSave) {
    // By all leaves: those whose boxes the ray enters in time, plus the nodes above them.
    const TestScene scene = star(3, 7);
    const Bvh bvh = build_bvh(scene.topology(), scene.positions());
    Random random(11);
    for (int i = 0; i < 200; ++i) {
        const Ray ray = ray_at(random.point(3e6), random.point(1e5));
        const Hit hit = cpu::ScalarTracer(bvh).intersect(ray);
        const float last = last_depth(hit.prim_id != kNoPrim ? hit.t : ray.tfar);
        const SlabRay slab = slab_ray(ray.org, ray.dir);
        std::uint32_t entered = 1;
        for (const Node& node : bvh.nodes) {
            for_each_child(node, [&](std::uint32_t slot, std::uint32_t) {
                const Box box = slot_box(node, slot);
                float t;
                const bool is_met = hits_box(slab, box.lower, box.upper, t);
                entered += is_met && t <= last ? 1 : 0;
            });
        }
        EXPECT_LE(count_steps(bvh, ray, hit), entered);
        EXPECT_GE(count_steps(bvh, ray, hit), hit.prim_id == kNoPrim ? 1u : 2u);
        if (hit.prim_id == kNoPrim) continue;
        EXPECT_LE(count_steps(bvh, ray, hit), count_steps(bvh, ray, no_hit()));
    }
}

TEST(TreeHeat, LoosenessIsTheBoxOverTwiceTheTriangles) {
    const std::vector<vec3> square = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
    EXPECT_EQ(leaf_looseness(tree_of(square, {{0, 1, 2}, {0, 2, 3}})), (std::vector{1.0f, 1.0f}));
    // A triangle across a cube: half a face's diagonal rectangle, 6 / sqrt(3).
    const std::vector<vec3> across = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    EXPECT_NEAR(leaf_looseness(tree_of(across, {{0, 1, 2}}))[0], 6 / std::sqrt(3.0), 1e-5);
    const std::vector<vec3> line = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}};
    EXPECT_EQ(leaf_looseness(tree_of(line, {{0, 1, 2}}))[0], std::numeric_limits<float>::max());
    std::vector<vec3> bad = across;
    bad[1] = vec3(kInvalidCoordinate);
    EXPECT_EQ(leaf_looseness(tree_of(bad, {{0, 1, 2}}))[0], 0.0f);
}

}  // namespace
}  // namespace mray
