// The built-in scenes: properties of all, those that are closed, and the one whose triangles change
// places.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <map>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "common/base/hash.h"
#include "scenes/procedural/procedural.h"
#include "scenes/trig.h"
#include "tests/support/animation_positions.h"
#include "tests/support/thrown_error.h"

namespace mray {
namespace {

DeformingMesh make_mesh(const std::string& name, std::uint64_t triangles) {
    const auto scenes = procedural_scenes();
    const auto scene =
        std::find_if(scenes.begin(), scenes.end(),
                     [&](const ProceduralScene& known) { return name == known.name; });
    return scene->make(triangles);
}

std::vector<std::string> names() {
    std::vector<std::string> all;
    for (const ProceduralScene& scene : procedural_scenes()) all.push_back(scene.name);
    return all;
}

std::uint64_t hash_at(const Animation& animation, double frame) {
    const std::vector<vec3> positions = test::positions_at(animation, frame);
    return Hasher().add(std::span(positions)).digest();
}

class EveryScene : public testing::TestWithParam<std::string> {};
INSTANTIATE_TEST_SUITE_P(Builtin, EveryScene, testing::ValuesIn(names()),
                         [](const auto& parameter) { return parameter.param; });

TEST_P(EveryScene, HasAboutAsManyTrianglesAsAskedFor) {
    const struct {
        std::uint64_t request;
        double tolerance;
    } cases[] = {{100, 0.25},   {333, 0.12},    {1000, 0.06},    {5000, 0.03},
                 {20000, 0.02}, {100000, 0.01}, {300000, 0.005}, {1000000, 0.003}};
    for (const auto& [request, tolerance] : cases) {
        const DeformingMesh mesh = make_mesh(GetParam(), request);
        EXPECT_NEAR(static_cast<double>(mesh.topology.triangles.size()), double(request),
                    tolerance * double(request))
            << request;
    }
}

TEST_P(EveryScene, HasValidIndicesAndOneAlbedoATriangleAndNoStrayVertex) {
    for (const std::uint64_t request : {1, 50, 777, 4000}) {
        const auto animation = make_procedural(GetParam(), request);
        const Topology& topology = animation->topology();
        EXPECT_EQ(topology.albedo.size(), topology.triangles.size());
        std::vector<bool> used(topology.vertex_count, false);
        for (const uvec3& t : topology.triangles) {
            for (int i = 0; i < 3; ++i) {
                ASSERT_LT(t[i], topology.vertex_count);
                used[t[i]] = true;
            }
            ASSERT_TRUE(t.x != t.y && t.y != t.z && t.z != t.x);
        }
        EXPECT_EQ(std::count(used.begin(), used.end(), false), 0);
    }
}

TEST_P(EveryScene, HasThePositionsThatItHasOnEveryMachine) {
    // XXH3 of the positions at frame 7.3 of the scene of 1000 triangles.
    const std::map<std::string, std::uint64_t> expected = {
        {"cloth", 0x5B45F1AE35FA322F},  {"twist", 0xF3B99C5CB7992B02},
        {"herd", 0x22667D2A6A2DDB38},   {"shuffle", 0x058E8DC6C5DDEA47},
        {"soup", 0xF4D0B89303796DD7},   {"spikes", 0xACE67F2A40506A62},
        {"orbits", 0xD92D7920893AFD82}, {"teleport", 0x41FAE2EE20ECC5E0},
        {"hall", 0xB5C8AC4AB8E23D02}};
    EXPECT_EQ(hash_at(*make_procedural(GetParam(), 1000), 7.3), expected.at(GetParam()));
}

TEST_P(EveryScene, HasTheBoundsOfItsFirstFrame) {
    const auto animation = make_procedural(GetParam(), 3000);
    ASSERT_EQ(animation->first_frame(), 0);
    ASSERT_EQ(animation->last_frame(), 24);
    const WorldBounds bounds = bounds_of(test::positions_at(*animation, 0));
    for (int axis = 0; axis < 3; ++axis) {
        EXPECT_EQ(animation->bounds().lower[axis], bounds.lower[axis]);
        EXPECT_EQ(animation->bounds().upper[axis], bounds.upper[axis]);
    }
}

TEST_P(EveryScene, MovesEachVertexAlikeInWhateverRangesItIsAsked) {
    const DeformingMesh mesh = make_mesh(GetParam(), 1500);
    const std::uint32_t count = mesh.topology.vertex_count;
    std::vector<vec3> whole(count);
    mesh.move(9.7, {0, count}, whole);
    for (const std::uint32_t step : {1u, 7u, 100u, 1001u}) {
        std::vector<vec3> parts(count, vec3(NAN, NAN, NAN));
        for (std::uint32_t begin = 0; begin < count; begin += step) {
            mesh.move(9.7, {begin, std::min(begin + step, count)}, parts);
        }
        EXPECT_EQ(parts, whole) << step;
    }
}

TEST(MakeProcedural, RefusesMoreThan2To28Triangles) {
    for (const std::uint64_t request : {(std::uint64_t{1} << 28) + 1, ~std::uint64_t{0}})
        EXPECT_EQ(test::kind_of([&] { make_procedural("cloth", request); }), ErrorKind::kLimit);
}

/// Six times the volume of the tetrahedron (origin, a, b, c), positive if a, b, c turn
/// counter-clockwise seen from outside.
long double volume6(vec3 a, vec3 b, vec3 c) {
    const auto wide = [](float x) { return static_cast<long double>(x); };
    return wide(a.x) * (wide(b.y) * c.z - wide(b.z) * c.y) +
           wide(a.y) * (wide(b.z) * c.x - wide(b.x) * c.z) +
           wide(a.z) * (wide(b.x) * c.y - wide(b.y) * c.x);
}

/// Six times the volume that a closed mesh encloses: positive if its triangles face outwards.
long double mesh_volume6(std::span<const uvec3> triangles, std::span<const vec3> positions) {
    long double volume = 0;
    for (const uvec3& t : triangles) {
        volume += volume6(positions[t.x], positions[t.y], positions[t.z]);
    }
    return volume;
}

std::uint64_t uneven_edges(const Topology& topology, const Animation& animation) {
    return count_edges(topology, test::positions_at(animation, 0)).uneven;
}

TEST(ClosedMeshes, ShareEachEdgeBetweenOppositeTriangles) {
    for (const char* name : {"spikes", "twist"}) {
        for (const std::uint64_t request : {1, 10, 123, 5000, 40000}) {
            const auto animation = make_procedural(name, request);
            EXPECT_EQ(uneven_edges(animation->topology(), *animation), 0u)
                << name << ' ' << request;
        }
    }
    // The first twelve triangles of the hall are its walls.
    const auto hall = make_procedural("hall", 5000);
    Topology walls = hall->topology();
    walls.triangles.resize(12);
    EXPECT_EQ(uneven_edges(walls, *hall), 0u);
    EXPECT_LT(mesh_volume6(walls.triangles, test::positions_at(*hall, 4)), 0);
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

constexpr long double kTwoPi = 6.283185307179586476925286766559005768L;

TEST(Trig, AgreesWithTheLibraryInLongDouble) {
    for (int i = -20000; i <= 20000; ++i) {
        const double x = i / 4096.0 * 1.000123;
        const long double turn = x - std::floor(x);
        EXPECT_NEAR(sin_turns(x), double(std::sin(kTwoPi * turn)), 0x1p-50) << x;
        EXPECT_NEAR(cos_turns(x), double(std::cos(kTwoPi * turn)), 0x1p-50) << x;
    }
}

TEST(Trig, IsExactAtQuarterTurns) {
    const double sines[] = {0, 1, 0, -1};
    for (int quarter = -40; quarter <= 40; ++quarter) {
        EXPECT_EQ(sin_turns(quarter / 4.0), sines[(quarter + 40) % 4]);
        EXPECT_EQ(cos_turns(quarter / 4.0), sines[(quarter + 41) % 4]);
    }
}

}  // namespace
}  // namespace mray
