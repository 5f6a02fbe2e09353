// Properties of all built-in scenes.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <vector>

#include "common/base/errors.h"
#include "common/base/hash.h"
#include "scenes/procedural/procedural.h"
#include "tests/scenes/procedural/mesh_checks.h"

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

TEST(MakeProcedural, RefusesAnUnknownName) {
    try {
        make_procedural("clot");
        ADD_FAILURE();
    } catch (const Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::kBadArgument);
    }
}

TEST(MakeProcedural, RefusesMoreThan2To28Triangles) {
    for (const std::uint64_t request : {(std::uint64_t{1} << 28) + 1, ~std::uint64_t{0}}) {
        try {
            make_procedural("cloth", request);
            ADD_FAILURE() << request;
        } catch (const Error& error) {
            EXPECT_EQ(error.kind(), ErrorKind::kLimit);
        }
    }
}

}  // namespace
}  // namespace mray
