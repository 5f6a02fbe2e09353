// Scenes that were made to be slow: the tree is as deep as any, its memory and the steps of rays
// grow in proportion to the triangles, and the answers are those of brute force.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <functional>

#include "common/bvh/builder/bvh_builder.h"
#include "common/bvh/bvh.h"
#include "cpu/reference/scalar_tracer.h"
#include "tests/support/test_scene.h"
#include "tests/support/tree_check.h"

namespace mray {
namespace {

using test::check_bvh;
using test::Random;
using test::TestScene;

struct HostileScene {
    const char* name;
    std::function<TestScene(std::uint32_t triangles)> make;
};

using Triangle = std::array<vec3, 3>;

/// Separate triangles.
TestScene separate(std::uint32_t count, const std::function<Triangle(std::uint32_t)>& triangle) {
    std::vector<vec3> positions;
    std::vector<uvec3> triangles;
    for (std::uint32_t i = 0; i < count; ++i) {
        for (const vec3& p : triangle(i)) positions.push_back(p);
        triangles.emplace_back(3 * i, 3 * i + 1, 3 * i + 2);
    }
    return {positions, triangles};
}

/// Large triangles that overlap each other.
TestScene overlapping(std::uint32_t count, double extent) {
    Random random(3);
    return separate(count, [&](std::uint32_t) {
        return Triangle{random.point(extent), random.point(extent), random.point(extent)};
    });
}

/// Small triangles in [-extent, extent], flat in z if asked for.
TestScene small_triangles(std::uint32_t count, double extent, bool is_flat) {
    Random random(5);
    const double size = extent / std::sqrt(count);
    return separate(count, [&](std::uint32_t) {
        const vec3 centre = random.point(extent);
        Triangle triangle = {centre + random.point(size), centre + random.point(size),
                             centre + random.point(size)};
        if (is_flat) {
            for (vec3& p : triangle) p.z = 0.5f;
        }
        return triangle;
    });
}

const Triangle kUnit = {vec3(0, 0, 0), vec3(1, 0, 0), vec3(0, 1, 0)};

TestScene repeated(std::uint32_t count) {
    return {{kUnit.begin(), kUnit.end()}, std::vector<uvec3>(count, uvec3(0, 1, 2))};
}

TestScene coincident(std::uint32_t count) {
    return separate(count, [](std::uint32_t) { return kUnit; });
}

/// One triangle of extent 1e38, and the others so small against it that they coincide.
TestScene with_outlier(std::uint32_t count) {
    Random random(7);
    return separate(count, [&](std::uint32_t i) {
        if (i == 0) return Triangle{vec3(-1e38, -1e38, 0), vec3(1e38, -1e38, 0), vec3(0, 1e38, 0)};
        return Triangle{random.point(1e-38), random.point(1e-38), random.point(1e-38)};
    });
}

/// Triangles about one axis whose sizes halve again and again: splits that are as uneven as can be.
TestScene nested(std::uint32_t count) {
    return separate(count, [&](std::uint32_t i) {
        const double size = std::exp2(-100.0 * i / count);
        const double z = 1e-3 * i / count;
        return Triangle{vec3(-size, -size, z), vec3(size, -size, z), vec3(0, size, z)};
    });
}

/// Vertices that are shared by triangles far apart.
TestScene scattered(std::uint32_t count) {
    Random random(9);
    std::vector<vec3> positions;
    for (std::uint32_t i = 0; i < count / 2; ++i) positions.push_back(random.point(1));
    std::vector<uvec3> triangles;
    for (std::uint32_t i = 0; i < count; ++i) {
        triangles.emplace_back(random.below(count / 2), random.below(count / 2),
                               random.below(count / 2));
    }
    return {positions, triangles};
}

TestScene not_finite(std::uint32_t count) {
    return separate(count, [](std::uint32_t) {
        return Triangle{vec3(NAN, NAN, NAN), vec3(NAN, 0, 0), vec3(0, 0, 0)};
    });
}

const HostileScene kScenes[] = {
    {"repeated", repeated},
    {"coincident", coincident},
    {"overlapping", [](std::uint32_t n) { return overlapping(n, 1); }},
    {"extents of 1e38", [](std::uint32_t n) { return overlapping(n, 1e38); }},
    {"outlier", with_outlier},
    {"one plane", [](std::uint32_t n) { return small_triangles(n, 1, true); }},
    {"nested", nested},
    {"scattered", scattered},
    {"not finite", not_finite},
};

/// Bytes of the tree with its tables.
std::uint64_t bytes_of(const Bvh& bvh) {
    return bvh.nodes.size() * (sizeof(Node) + sizeof(std::uint32_t)) +
           bvh.leaves.size() * (sizeof(Leaf) + (kLeafVertices + 1) * sizeof(std::uint32_t));
}

/// The steps of 64 rays through the middle of the scene.
std::uint64_t steps_of(const TestScene& scene, const Bvh& bvh) {
    std::uint64_t steps = 0;
    for (const Ray& ray : test::mixed_rays(scene, 64, 1)) {
        steps += cpu::count_steps(bvh, ray, no_hit());
    }
    return steps;
}

TEST(HostileScenes, HaveTreesOfBoundedDepthAndMemory) {
    for (const HostileScene& hostile : kScenes) {
        const TestScene scene = hostile.make(20'000);
        const Bvh bvh = build_bvh(scene.topology(), scene.positions());
        EXPECT_EQ(check_bvh(bvh, scene.topology(), scene.positions()), std::vector<std::string>{})
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
        for (const std::uint32_t count : {4'000u, 16'000u, 64'000u}) {
            const TestScene scene = hostile.make(count);
            const Bvh bvh = build_bvh(scene.topology(), scene.positions());
            const std::uint64_t steps = steps_of(scene, bvh);
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
