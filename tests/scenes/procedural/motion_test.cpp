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

TEST(Collapse, LiesInAPlaneOrAPointInSomeFramesAndIsWholeBetween) {
    const auto clip = make_procedural("collapse", 2000);
    const std::vector<vec3> whole = positions_of(*clip, 0);
    const auto spread = [](const std::vector<vec3>& points, int axis) {
        const auto [lower, upper] = std::minmax_element(
            points.begin(), points.end(), [&](vec3 a, vec3 b) { return a[axis] < b[axis]; });
        return (*upper)[axis] - (*lower)[axis];
    };
    for (const double frame : {2.0, 10.0, 18.0}) {
        const std::vector<vec3> flat = positions_of(*clip, frame);
        EXPECT_EQ(spread(flat, 1), 0);
        EXPECT_GT(spread(flat, 0), 1.9f);
        EXPECT_GT(spread(flat, 2), 1.9f);
    }
    for (const double frame : {6.0, 14.0, 22.0}) {
        const std::vector<vec3> point = positions_of(*clip, frame);
        for (int axis = 0; axis < 3; ++axis) EXPECT_EQ(spread(point, axis), 0);
    }
    for (const double frame : {4.0, 8.0, 12.0, 16.0, 20.0, 24.0}) {
        EXPECT_EQ(positions_of(*clip, frame), whole);
    }
}

TEST(Explode, StartsAsAHollowSphereAndSpreads) {
    const auto clip = make_procedural("explode", 20000);
    const auto radius = [](vec3 p) { return std::hypot(p.x, p.y, p.z); };
    for (const vec3& p : positions_of(*clip, 0)) {
        EXPECT_NEAR(std::fabs(radius(p) - 0.9f), 0.1f, 1e-6f);
    }
    float mean = 0;
    const std::vector<vec3> end = positions_of(*clip, 24);
    for (const vec3& p : end) mean += radius(p) / static_cast<float>(end.size());
    EXPECT_GT(mean, 2);
}

TEST(Explode, KeepsItsChunksRigid) {
    const DeformingMesh mesh = make_explode(5000);
    const std::vector<vec3> start = moved(mesh, 0);
    const std::vector<vec3> later = moved(mesh, 17.3);
    for (const uvec3& t : mesh.topology.triangles) {
        for (int k = 0; k < 3; ++k) {
            const vec3 before = start[t[k]] - start[t[(k + 1) % 3]];
            const vec3 after = later[t[k]] - later[t[(k + 1) % 3]];
            ASSERT_NEAR(std::hypot(after.x, after.y, after.z),
                        std::hypot(before.x, before.y, before.z), 2e-6);
        }
    }
}

TEST(Gather, EndsAsItBeganAndIsApartBetween) {
    const auto clip = make_procedural("gather", 5000);
    EXPECT_EQ(positions_of(*clip, 24), positions_of(*clip, 0));
    EXPECT_EQ(positions_of(*clip, 0), positions_of(*make_procedural("explode", 5000), 0));
    double farthest = 0;
    for (const vec3& p : positions_of(*clip, 12)) farthest = std::max<double>(farthest, p.x);
    EXPECT_GT(farthest, 2);
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

}  // namespace
}  // namespace mray
