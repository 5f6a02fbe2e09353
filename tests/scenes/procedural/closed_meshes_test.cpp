// The scenes that claim to be closed meshes, and the one whose triangles change places.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <bit>
#include <vector>

#include "scenes/procedural/procedural.h"
#include "tests/scenes/procedural/mesh_checks.h"

namespace mray {
namespace {

TEST(ClosedMeshes, ShareEachEdgeBetweenTwoOppositeTriangles) {
    for (const char* name : {"spikes", "twist"}) {
        for (const std::uint64_t request : {1, 10, 123, 5000, 40000}) {
            const auto animation = make_procedural(name, request);
            EXPECT_EQ(open_edges(animation->topology().triangles), 0u) << name << ' ' << request;
        }
    }
    // The first twelve triangles of the hall are its walls.
    const auto hall = make_procedural("hall", 5000);
    const auto walls = std::span(hall->topology().triangles).first(12);
    EXPECT_EQ(open_edges(walls), 0u);
    EXPECT_LT(mesh_volume6(walls, test::positions_at(*hall, 4)), 0);
}

TEST(ClosedMeshes, FaceOutwards) {
    for (const char* name : {"spikes", "twist", "shuffle"}) {
        const auto animation = make_procedural(name, 3000);
        for (const double frame : {0.0, 4.0, 12.0, 20.3}) {
            EXPECT_GT(mesh_volume6(animation->topology().triangles,
                                   test::positions_at(*animation, frame)),
                      0)
                << name << ' ' << frame;
        }
    }
}

TEST(Spikes, IsStarShapedAroundTheOrigin) {
    for (const std::uint64_t request : {1, 200, 20000, 200000}) {
        const auto animation = make_procedural("spikes", request);
        for (const double frame : {0.0, 1.0, 3.7, 11.0, 24.0}) {
            const std::vector<vec3> positions = test::positions_at(*animation, frame);
            for (const uvec3& t : animation->topology().triangles) {
                ASSERT_GT(volume6(positions[t.x], positions[t.y], positions[t.z]), 0)
                    << request << ' ' << frame;
            }
        }
    }
}

using TriangleBits = std::array<std::uint32_t, 9>;

std::vector<TriangleBits> triangle_bits(const Animation& animation, double frame) {
    const std::vector<vec3> positions = test::positions_at(animation, frame);
    std::vector<TriangleBits> triangles;
    for (const uvec3& t : animation.topology().triangles) {
        TriangleBits& bits = triangles.emplace_back();
        for (int i = 0; i < 9; ++i)
            bits[i] = std::bit_cast<std::uint32_t>(positions[t[i / 3]][i % 3]);
    }
    return triangles;
}

TEST(Shuffle, HasTheSameTrianglesInEveryFrame) {
    for (const std::uint64_t request : {1, 20, 37, 500, 1024, 9000}) {
        const auto animation = make_procedural("shuffle", request);
        auto expected = triangle_bits(*animation, 0);
        std::sort(expected.begin(), expected.end());
        EXPECT_EQ(std::adjacent_find(expected.begin(), expected.end()), expected.end());
        for (const double frame : {0.5, 1.0, 2.999, 7.0, 24.0}) {
            auto actual = triangle_bits(*animation, frame);
            std::sort(actual.begin(), actual.end());
            EXPECT_EQ(actual, expected) << request << ' ' << frame;
        }
    }
}

}  // namespace
}  // namespace mray
