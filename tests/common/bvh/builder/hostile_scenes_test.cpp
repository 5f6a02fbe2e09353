// Scenes that were made to be slow: the tree is as deep as any, its memory and the steps of rays
// grow in proportion to the triangles,
#include <gtest/gtest.h>

#include <cmath>

#include "common/bvh/builder/bvh_builder.h"
#include "common/bvh/bvh.h"
#include "cpu/reference/scalar_tracer.h"
#include "tests/support/test_scene.h"
#include "tests/support/tree_check.h"

namespace mray {
namespace {

using test::Random;
using test::Shape;
using test::TestScene;
namespace shapes = test::shapes;

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

TestScene make(const HostileScene& hostile, int triangles) {
    Random random(3);
    return hostile.make(random, triangles);
}

/// Bytes of the tree with its tables.
std::uint64_t bytes_of(const Bvh& bvh) {
    return bvh.nodes.size() * (sizeof(Node) + sizeof(std::uint32_t)) +
           bvh.leaves.size() * (sizeof(Leaf) + (kLeafVertices + 1) * sizeof(std::uint32_t));
}

/// The steps of 64 rays through the scene.
std::uint64_t steps_of(const Bvh& bvh) {
    std::uint64_t steps = 0;
    Random random(1);
    for (int i = 0; i < 64; ++i) {
        const vec3 org = snap_point(random.point(3 * kSceneExtent));
        const vec3 dir = canonical_direction(snap_point(random.point(kSceneExtent)) - org);
        steps += cpu::count_steps(bvh, {org, 0, dir, kInfiniteT}, no_hit());
    }
    return steps;
}

TEST(HostileScenes, HaveTreesOfBoundedDepthAndMemory) {
    for (const HostileScene& hostile : kScenes) {
        const TestScene scene = make(hostile, 20'000);
        const Bvh bvh = build_bvh(scene.topology(), scene.positions());
        EXPECT_EQ(test::check_bvh(bvh, scene.topology(), scene.positions()),
                  std::vector<std::string>{})
            << hostile.name;
        EXPECT_LE(bvh.depth(), kMaxDepth) << hostile.name;
        // A leaf holds any five triangles, and a node two children or more.
        if (bvh.leaves.size() > 1) {
            EXPECT_GE(bvh_stats(bvh).triangles_per_leaf, 1.75) << hostile.name;
        }
        EXPECT_LE(bytes_of(bvh), 256u * scene.triangle_count()) << hostile.name;
    }
}

TEST(HostileScenes, TakeStepsInProportionToTheTriangles) {
    for (const HostileScene& hostile : kScenes) {
        std::uint64_t last = 0;
        for (const int count : {4'000, 16'000, 64'000}) {
            const TestScene scene = make(hostile, count);
            const Bvh bvh = build_bvh(scene.topology(), scene.positions());
            const std::uint64_t steps = steps_of(bvh);
            EXPECT_LE(steps, 64u * (bvh.nodes.size() + bvh.leaves.size())) << hostile.name;
            // Four times the triangles, and some more where the tree is deeper.
            if (last > 0) {
                EXPECT_LE(steps, 5 * last) << hostile.name;
            }
            last = steps;
        }
    }
}

}  // namespace
}  // namespace mray
