// How each built-in scene moves.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <glm/geometric.hpp>
#include <set>
#include <vector>

#include "scenes/procedural/procedural.h"
#include "scenes/procedural/scenes.h"
#include "tests/scenes/procedural/mesh_checks.h"

namespace mray {
namespace {

constexpr long double kPi = 3.141592653589793238462643383279502884L;

std::vector<vec3> moved(const DeformingMesh& mesh, double frame) {
    std::vector<vec3> positions(mesh.topology.vertex_count);
    mesh.move(frame, {0, mesh.topology.vertex_count}, positions);
    return positions;
}

using TriangleBits = std::array<std::uint32_t, 9>;

std::vector<TriangleBits> triangle_bits(const Clip& clip, double frame) {
    const std::vector<vec3> positions = positions_of(clip, frame);
    std::vector<TriangleBits> triangles;
    for (const uvec3& t : clip.topology().triangles) {
        TriangleBits& bits = triangles.emplace_back();
        for (int i = 0; i < 9; ++i) {
            bits[i] = std::bit_cast<std::uint32_t>(positions[t[i / 3]][i % 3]);
        }
    }
    return triangles;
}

TEST(Shuffle, HasTheSameTrianglesInEveryFrame) {
    for (const std::uint64_t request : {1, 20, 37, 500, 1024, 9000}) {
        const auto clip = make_procedural("shuffle", request);
        auto expected = triangle_bits(*clip, 0);
        std::sort(expected.begin(), expected.end());
        EXPECT_EQ(std::adjacent_find(expected.begin(), expected.end()), expected.end());
        for (const double frame : {0.5, 1.0, 2.999, 7.0, 24.0}) {
            auto actual = triangle_bits(*clip, frame);
            std::sort(actual.begin(), actual.end());
            EXPECT_EQ(actual, expected) << request << ' ' << frame;
        }
    }
}

TEST(Shuffle, PutsAlmostEveryTriangleElsewhereInEachWholeFrame) {
    const auto clip = make_procedural("shuffle", 10000);
    for (int frame = 1; frame <= 24; ++frame) {
        const auto before = triangle_bits(*clip, frame - 1);
        const auto after = triangle_bits(*clip, frame);
        std::size_t same = 0;
        for (std::size_t i = 0; i < before.size(); ++i) same += before[i] == after[i];
        EXPECT_LT(same, 12u) << frame;
        EXPECT_EQ(triangle_bits(*clip, frame - 0.01), before);
    }
}

TEST(Shuffle, LeavesNoTraceOfTheOrderThatItStartsFrom) {
    // Neighbours in the list are on average as far apart as any two triangles.
    const auto clip = make_procedural("shuffle", 10000);
    const auto mean_step = [&](double frame) {
        const std::vector<vec3> p = positions_of(*clip, frame);
        double sum = 0;
        for (std::size_t i = 3; i < p.size(); i += 3) {
            sum += std::hypot(p[i].x - p[i - 3].x, p[i].y - p[i - 3].y, p[i].z - p[i - 3].z);
        }
        return sum / static_cast<double>(p.size() / 3);
    };
    EXPECT_LT(mean_step(0), 0.1);
    for (const double frame : {1.0, 2.0, 13.0, 24.0}) EXPECT_GT(mean_step(frame), 1.0);
}

TEST(Shuffle, HasOneColour) {
    const auto clip = make_procedural("shuffle", 1000);
    const std::vector<Albedo>& albedo = clip->topology().albedo;
    EXPECT_EQ(std::set<Albedo>(albedo.begin(), albedo.end()).size(), 1u);
}

TEST(StaticTriangles, NeverMove) {
    for (const DeformingMesh& mesh : {make_herd(4000), make_cloth(4000), make_herd(1)}) {
        const std::vector<vec3> start = moved(mesh, 0);
        for (const double frame : {1.0, 5.5, 24.0}) {
            const std::vector<vec3> now = moved(mesh, frame);
            for (std::uint32_t i = 0; i < mesh.static_triangle_count; ++i) {
                const uvec3 t = mesh.topology.triangles[i];
                for (int k = 0; k < 3; ++k) ASSERT_EQ(now[t[k]], start[t[k]]);
            }
        }
    }
}

TEST(Herd, IsAtLeastHalfStatic) {
    for (const std::uint64_t request : {1, 100, 101, 150, 999, 30000, 400000}) {
        const DeformingMesh mesh = make_herd(request);
        EXPECT_GE(2 * mesh.static_triangle_count, mesh.topology.triangles.size()) << request;
        EXPECT_LT(mesh.static_triangle_count, mesh.topology.triangles.size()) << request;
    }
}

TEST(Herd, MovesEveryAnimalAsARigidBody) {
    const DeformingMesh mesh = make_herd(20000);
    const std::vector<vec3> start = moved(mesh, 0);
    const std::vector<vec3> later = moved(mesh, 9.4);
    const auto length = [](vec3 a, vec3 b) {
        return std::hypot(double(a.x) - b.x, double(a.y) - b.y, double(a.z) - b.z);
    };
    std::size_t still = 0;
    for (std::size_t i = mesh.static_triangle_count; i < mesh.topology.triangles.size(); ++i) {
        const uvec3 t = mesh.topology.triangles[i];
        for (int k = 0; k < 3; ++k) {
            const std::uint32_t a = t[k];
            const std::uint32_t b = t[(k + 1) % 3];
            ASSERT_NEAR(length(later[a], later[b]), length(start[a], start[b]), 1e-5);
        }
        if (start[t.x] == later[t.x]) ++still;
    }
    EXPECT_EQ(still, 0u);
}

TEST(Twist, TurnsEachHeightByItsShareOfFourTurns) {
    const DeformingMesh mesh = make_twist(5000);
    const std::vector<vec3> start = moved(mesh, 0);
    for (const double frame : {0.0, 1.0, 3.0, 10.5, 24.0}) {
        const std::vector<vec3> now = moved(mesh, frame);
        for (std::size_t i = 0; i < start.size(); ++i) {
            const vec3 p = start[i];
            const long double angle = 2 * kPi * 4 * (frame / 24) * (p.y / 4);
            ASSERT_EQ(now[i].y, p.y);
            ASSERT_NEAR(now[i].x, double(p.x * std::cos(angle) + p.z * std::sin(angle)), 3e-6);
            ASSERT_NEAR(now[i].z, double(p.z * std::cos(angle) - p.x * std::sin(angle)), 3e-6);
        }
    }
}

TEST(Twist, StartsAsAnUprightColumnFourTimesAsHighAsWide) {
    const std::vector<vec3> start = moved(make_twist(5000), 0);
    float widest = 0;
    float highest = 0;
    for (const vec3& p : start) {
        widest = std::max({widest, std::fabs(p.x), std::fabs(p.z)});
        highest = std::max(highest, p.y);
        EXPECT_GE(p.y, 0);
    }
    EXPECT_NEAR(2 * widest, 1, 0.05);
    EXPECT_NEAR(highest, 4, 0.05);
}

TEST(Orbits, KeepsItsBallsRigidAndMovesAllOfThem) {
    const DeformingMesh mesh = make_orbits(3000);
    const std::vector<vec3> before = moved(mesh, 0);
    const std::vector<vec3> after = moved(mesh, 9.25);
    for (const uvec3& t : mesh.topology.triangles) {
        const double edge = glm::length(glm::dvec3(before[t.x]) - glm::dvec3(before[t.y]));
        EXPECT_NEAR(glm::length(glm::dvec3(after[t.x]) - glm::dvec3(after[t.y])), edge, 1e-6);
        EXPECT_NE(before[t.x], after[t.x]);
    }
}

TEST(Cloth, NeverEntersTheBallOrTheGround) {
    const DeformingMesh mesh = make_cloth(60000);
    std::set<std::uint32_t> sheet;
    for (std::size_t i = mesh.static_triangle_count; i < mesh.topology.triangles.size(); ++i) {
        for (int k = 0; k < 3; ++k) sheet.insert(mesh.topology.triangles[i][k]);
    }
    for (double frame = 0; frame <= 24; frame += 0.5) {
        const std::vector<vec3> positions = moved(mesh, frame);
        for (const std::uint32_t i : sheet) {
            const vec3 p = positions[i];
            ASSERT_GT(std::hypot(p.x, p.y - 1, p.z), 1.01) << frame;
            ASSERT_GT(p.y, 0.01f) << frame;
        }
    }
}

TEST(Cloth, EndsHangingAroundTheBall) {
    const DeformingMesh mesh = make_cloth(60000);
    const auto lowest = [&](double frame) {
        float y = 10;
        const std::vector<vec3> positions = moved(mesh, frame);
        for (std::size_t i = mesh.static_triangle_count; i < mesh.topology.triangles.size(); ++i) {
            y = std::min(y, positions[mesh.topology.triangles[i].x].y);
        }
        return y;
    };
    EXPECT_GT(lowest(0), 2.0f);
    EXPECT_LT(lowest(24), 0.6f);
}

TEST(Hall, IsClosedRoundTheEyesThatLookAtIt) {
    {
        const DeformingMesh mesh = make_hall(5000);
        // The first twelve triangles are the walls.
        const auto walls = std::span(mesh.topology.triangles).first(12);
        EXPECT_EQ(open_edges(walls), 0u);
        const std::vector<vec3> positions = moved(mesh, 4);
        EXPECT_LT(mesh_volume6(walls, positions), 0);
        vec3 lower = positions[0];
        vec3 upper = positions[0];
        for (const vec3& p : std::span(positions).first(8)) {
            lower = glm::min(lower, p);
            upper = glm::max(upper, p);
        }
        for (const vec3& p : positions) {
            EXPECT_EQ(glm::min(lower, p), lower);
            EXPECT_EQ(glm::max(upper, p), upper);
        }
    }
}

}  // namespace
}  // namespace mray
