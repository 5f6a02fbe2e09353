// Meshes and nodes of glTF files.
#include <gtest/gtest.h>

#include <cmath>

#include "scenes/mesh/mesh_file.h"
#include "tests/scenes/gltf/gltf_builder.h"
#include "tests/scenes/gltf/opened_gltf.h"

namespace mray {
namespace {

using namespace test;

using Triangles = std::vector<uvec3>;

/// Five points of a strip.
const std::vector<float> kFive = {0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0, 0, 2, 0};

GltfBuilder five_points(int mode, const std::vector<std::uint8_t>& indices = {}) {
    GltfBuilder builder;
    Json more = {{"mode", mode}};
    if (!indices.empty()) more["indices"] = builder.add_accessor(indices, "SCALAR");
    builder.add(
        "nodes",
        {{"mesh", builder.add_mesh({{"POSITION", builder.add_accessor(kFive, "VEC3")}}, more)}});
    return builder;
}

TEST(GltfMesh, IsReadFromTextAndFromBinary) {
    const GltfBuilder builder = triangle_file();
    for (const auto& [bytes, name] :
         {std::pair(builder.gltf(), "a.gltf"), std::pair(builder.glb(), "a.glb"),
          std::pair(builder.glb(), "a.GLB")}) {
        const OpenedGltf scene(bytes, {}, name);
        EXPECT_EQ(scene.topology().triangles, (Triangles{{0, 1, 2}}));
        EXPECT_EQ(scene.at(0), (std::vector<vec3>{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}));
        EXPECT_EQ(scene.animation->last_frame(), 0);
        EXPECT_FALSE(scene.animation->fps());
        EXPECT_TRUE(scene.warnings.empty());
    }
}

TEST(GltfMesh, KeepsItsDigitsFarFromZero) {
    GltfBuilder builder = triangle_file();
    builder.json["nodes"][0]["translation"] = {528980.85, 183526.1, 10.0};
    const OpenedGltf scene(builder.gltf());
    const Origin origin = scene.animation->origin();
    EXPECT_NE(origin, Origin());
    const glm::dvec3 first = origin.from_world(glm::dvec3(scene.at(0)[0]));
    EXPECT_NEAR(first.x, 528980.85, 1e-6);
    EXPECT_NEAR(first.y, 183526.1, 1e-6);
    EXPECT_NEAR(first.z, 10, 1e-6);
    EXPECT_EQ(OpenedGltf(triangle_file().gltf()).animation->origin(), Origin());
}

TEST(GltfMesh, StripsAndFansAreTrianglesInTheOrderOfTheSpecification) {
    EXPECT_EQ(OpenedGltf(five_points(5).gltf()).topology().triangles,
              (Triangles{{0, 1, 2}, {1, 3, 2}, {2, 3, 4}}));
    EXPECT_EQ(OpenedGltf(five_points(6).gltf()).topology().triangles,
              (Triangles{{1, 2, 0}, {2, 3, 0}, {3, 4, 0}}));
    EXPECT_EQ(OpenedGltf(five_points(5, {4, 3, 2, 0}).gltf()).topology().triangles,
              (Triangles{{4, 3, 2}, {3, 0, 2}}));
}

TEST(GltfMesh, PointsAndLinesAreLeftOutWithAWarning) {
    GltfBuilder builder = triangle_file();
    Json line = builder.json["meshes"][0]["primitives"][0];
    line["mode"] = 1;
    builder.json["meshes"][0]["primitives"].push_back(line);
    const OpenedGltf scene(builder.gltf());
    EXPECT_EQ(scene.topology().triangles.size(), 1u);
    ASSERT_EQ(scene.warnings.size(), 1u);
    EXPECT_TRUE(has(scene.warnings[0], "meshes[0].primitives[1]: points or lines"));

    EXPECT_EQ(gltf_error(five_points(0).gltf()), "scene.gltf: its scene has no triangles");
    EXPECT_EQ(gltf_error(five_points(0).gltf(), {.lenient = true}),
              "scene.gltf: its scene has no triangles");
}

TEST(GltfNodes, TransformationsMultiplyDownTheTree) {
    GltfBuilder builder;
    const int mesh = builder.add_triangle();
    const double h = std::sqrt(0.5);
    // A quarter turn about z and twice the size, 10 to the right; in it, 1 along its own x.
    builder.add("nodes", {{"translation", {10, 0, 0}},
                          {"rotation", {0, 0, h, h}},
                          {"scale", {2, 2, 2}},
                          {"children", {1}}});
    builder.add("nodes", {{"translation", {1, 0, 0}}, {"mesh", mesh}});
    // The same by matrices, in columns.
    builder.add("nodes", {{"matrix", {0, 2, 0, 0, -2, 0, 0, 0, 0, 0, 2, 0, 10, 0, 0, 1}},
                          {"children", {3}}});
    builder.add("nodes",
                {{"matrix", {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 1, 0, 0, 1}}, {"mesh", mesh}});
    const OpenedGltf scene(builder.gltf());
    const std::vector<vec3> p = scene.at(0);
    ASSERT_EQ(p.size(), 6u);
    for (const std::size_t first : {0u, 3u}) {
        expect_point(p[first], 10, 2, 0);
        expect_point(p[first + 1], 10, 4, 0);
        expect_point(p[first + 2], 8, 2, 0);
    }
}

TEST(GltfNodes, MirroredMeshesKeepTheirOutside) {
    GltfBuilder builder;
    const int mesh = builder.add_triangle();
    builder.add("nodes", {{"mesh", mesh}, {"scale", {-1, 1, 1}}, {"children", {1, 2}}});
    // Mirrored twice, and by a matrix below one that does not mirror.
    builder.add("nodes", {{"mesh", mesh}, {"scale", {1, -2, 1}}});
    builder.add("nodes", {{"mesh", mesh}, {"scale", {2, 2, 2}}});
    builder.add("nodes",
                {{"mesh", mesh}, {"matrix", {0, 1, 0, 0, 1, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1}}});
    const OpenedGltf scene(builder.gltf());
    const std::vector<uvec3>& triangles = scene.topology().triangles;
    ASSERT_EQ(triangles.size(), 4u);
    EXPECT_EQ(triangles[0], uvec3(0, 2, 1));
    EXPECT_EQ(triangles[1], uvec3(3, 4, 5));
    EXPECT_EQ(triangles[2], uvec3(6, 8, 7));
    EXPECT_EQ(triangles[3], uvec3(9, 11, 10));
}

TEST(GltfNodes, InstancesAreBakedDepthFirst) {
    GltfBuilder builder;
    const int mesh = builder.add_triangle();
    builder.add("nodes", {{"children", {2, 1}}, {"mesh", mesh}});
    builder.add("nodes", {{"mesh", mesh}, {"translation", {1, 0, 0}}});
    builder.add("nodes", {{"children", {3}}, {"mesh", mesh}, {"translation", {2, 0, 0}}});
    builder.add("nodes", {{"mesh", mesh}, {"translation", {0, 3, 0}}});
    const OpenedGltf scene(builder.gltf());
    const std::vector<vec3> p = scene.at(0);
    ASSERT_EQ(p.size(), 12u);
    EXPECT_EQ(p[0], vec3(0, 0, 0));
    EXPECT_EQ(p[3], vec3(2, 0, 0));
    EXPECT_EQ(p[6], vec3(2, 3, 0));
    EXPECT_EQ(p[9], vec3(1, 0, 0));
    EXPECT_EQ(scene.topology().triangles[3], uvec3(9, 10, 11));
}

/// x of the first vertex of each triangle.
std::vector<float> xs_of(const GltfBuilder& builder) {
    const OpenedGltf scene(builder.gltf());
    const std::vector<vec3> p = scene.at(0);
    std::vector<float> xs;
    for (std::size_t i = 0; i < p.size(); i += 3) xs.push_back(p[i].x);
    return xs;
}

TEST(GltfNodes, TheDefaultSceneIsShown) {
    GltfBuilder builder;
    const int mesh = builder.add_triangle();
    for (const int x : {1, 2, 3})
        builder.add("nodes", {{"mesh", mesh}, {"translation", {x, 0, 0}}});
    EXPECT_EQ(xs_of(builder), (std::vector<float>{1, 2, 3}));
    builder.json["scenes"] = {{{"nodes", {1}}}, {{"nodes", {2, 0}}}};
    EXPECT_EQ(xs_of(builder), (std::vector<float>{2}));
    builder.json["scene"] = 1;
    EXPECT_EQ(xs_of(builder), (std::vector<float>{3, 1}));
}

TEST(GltfNodes, AChainOfFiftyThousandIsNoRecursion) {
    GltfBuilder builder;
    const int mesh = builder.add_triangle();
    constexpr int kLength = 50000;
    Json nodes = Json::array();
    for (int i = 0; i + 1 < kLength; ++i)
        nodes.push_back({{"children", {i + 1}}, {"translation", {1, 0, 0}}});
    nodes.push_back({{"mesh", mesh}});
    builder.json["nodes"] = nodes;
    EXPECT_EQ(OpenedGltf(builder.gltf()).at(0)[0], vec3(kLength - 1, 0, 0));
}

TEST(GltfAccessors, InterleavedNormalizedAndSparse) {
    GltfBuilder builder;
    // Position and four bytes of something else, in turns.
    const int view = builder.add_view<float>({0, 0, 0, 9, 1, 0, 0, 9, 0, 1, 0, 9}, 16);
    const int replaced = builder.add_view<float>({5, 6, 7});
    const int indices = builder.add_view<std::uint16_t>({1});
    const int position =
        builder.add("accessors", {{"bufferView", view},
                                  {"componentType", 5126},
                                  {"count", 3},
                                  {"type", "VEC3"},
                                  {"sparse",
                                   {{"count", 1},
                                    {"indices", {{"bufferView", indices}, {"componentType", 5123}}},
                                    {"values", {{"bufferView", replaced}}}}}});
    builder.add("nodes", {{"mesh", builder.add_mesh({{"POSITION", position}})}});
    EXPECT_EQ(OpenedGltf(builder.gltf()).at(0),
              (std::vector<vec3>{{0, 0, 0}, {5, 6, 7}, {0, 1, 0}}));
}

TEST(GltfAccessors, QuantizedPositions) {
    const auto open = [](auto type, bool normalized, bool is_declared) {
        using T = decltype(type);
        GltfBuilder builder;
        // Padded to four components of a stride.
        const int view =
            builder.add_view<T>({0, 0, 0, 0, 127, 0, 0, 0, 0, T(-127), 0, 0}, 4 * sizeof(T));
        Json accessor = {{"bufferView", view},
                         {"componentType", component_of<T>()},
                         {"count", 3},
                         {"type", "VEC3"}};
        if (normalized) accessor["normalized"] = true;
        builder.add("nodes",
                    {{"mesh", builder.add_mesh({{"POSITION", builder.add("accessors", accessor)}})},
                     {"scale", {2, 2, 2}}});
        if (is_declared) {
            builder.json["extensionsUsed"] = {"KHR_mesh_quantization"};
            builder.json["extensionsRequired"] = {"KHR_mesh_quantization"};
        }
        return builder.gltf();
    };
    EXPECT_EQ(OpenedGltf(open(std::int8_t{}, true, true)).at(0)[1], vec3(2, 0, 0));
    EXPECT_EQ(OpenedGltf(open(std::int8_t{}, true, true)).at(0)[2], vec3(0, -2, 0));
    EXPECT_EQ(OpenedGltf(open(std::int16_t{}, false, true)).at(0)[2], vec3(0, -254, 0));
    EXPECT_EQ(OpenedGltf(open(std::uint8_t{}, false, true)).at(0)[2], vec3(0, 258, 0));
    EXPECT_EQ(OpenedGltf(open(std::int16_t{}, false, false)).at(0)[2], vec3(0, -254, 0));
}

TEST(GltfNormals, CornersThatShareThemAreSmooth) {
    GltfBuilder builder;
    // Two triangles; vertices 3 and 4 repeat 1 and 2, one of them with another normal.
    const std::vector<float> positions = {0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 0, -0.0f, 0, 1, 0, 1, 1, 0};
    const std::vector<float> normals = {0, 0, 1, 0, 0, 1, 0, 0, 1, -0.0f, 0, 1, 0, 1, 0, 0, 0, 1};
    builder.add("nodes",
                {{"mesh", builder.add_mesh({{"POSITION", builder.add_accessor(positions, "VEC3")},
                                            {"NORMAL", builder.add_accessor(normals, "VEC3")}})}});
    const OpenedGltf scene(builder.gltf());
    const auto smooth = scene.animation->smooth_corners();
    ASSERT_EQ(smooth.size(), 2u);
    EXPECT_EQ(smooth[0], uvec3(0, 1, 2));
    EXPECT_EQ(smooth[1], uvec3(1, 4, 5));
    EXPECT_TRUE(OpenedGltf(triangle_file().gltf()).animation->smooth_corners().empty());
}

}  // namespace
}  // namespace mray
