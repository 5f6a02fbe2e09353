// Extensions that glTF files use and require.
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "tests/scenes/gltf/gltf_builder.h"
#include "tests/scenes/gltf/opened_gltf.h"

namespace mray {
namespace {

using namespace test;

TEST(GltfExtensions, ThatDoNotConcernTrianglesAreLeftOutWithOneWarning) {
    GltfBuilder builder = triangle_file();
    builder.json["extensions"]["KHR_lights_punctual"]["lights"] = {{{"type", "point"}}};
    builder.json["nodes"][0]["extensions"]["KHR_lights_punctual"]["light"] = 0;
    builder.json["extensionsUsed"] = {"KHR_lights_punctual", "KHR_mesh_quantization"};
    const OpenedGltf used(builder.gltf());
    EXPECT_TRUE(used.warnings().empty());
    builder.json["extensionsRequired"] = {"KHR_mesh_quantization",   "KHR_lights_punctual",
                                          "KHR_materials_clearcoat", "KHR_materials_of_tomorrow",
                                          "EXT_texture_webp",        "KHR_texture_transform"};
    const OpenedGltf required(builder.gltf());
    EXPECT_EQ(required.at(0), used.at(0));
    ASSERT_EQ(required.warnings().size(), 1u);
    EXPECT_NE(required.warnings()[0].find("scene.gltf: warning: extensionsRequired[1]: "
                                          "'KHR_lights_punctual' is required, but not read; left "
                                          "out"),
              std::string::npos)
        << required.warnings()[0];
    EXPECT_NE(required.warnings()[0].find("3 more"), std::string::npos) << required.warnings()[0];
}

TEST(GltfExtensions, ThatMayConcernTrianglesAreRefusedIfTheyAreRequired) {
    GltfBuilder builder = triangle_file();
    for (const char* const name : {"KHR_draco_mesh_compression", "ACME_shapes", "KHR_lights"}) {
        builder.json["extensionsUsed"] = {name};
        builder.json.erase("extensionsRequired");
        EXPECT_EQ(gltf_error(builder.gltf()), "");
        builder.json["extensionsRequired"] = {"KHR_lights_punctual", name};
        EXPECT_EQ(gltf_error(builder.gltf()),
                  std::string("scene.gltf: extensionsRequired[1]: the extension '") + name +
                      "' is required, but not known; write the file without it");
    }
}

TEST(GltfExtensions, ThatChangeShapesAreNamedEachIfTheyAreUsed) {
    GltfBuilder builder = triangle_file();
    builder.json["extensionsUsed"] = {"KHR_animation_pointer", "KHR_lights_punctual",
                                      "KHR_node_visibility"};
    const OpenedGltf used(builder.gltf());
    ASSERT_EQ(used.warnings().size(), 2u);
    EXPECT_NE(used.warnings()[0].find("'KHR_animation_pointer' changes shapes"), std::string::npos);
    EXPECT_NE(used.warnings()[1].find("'KHR_node_visibility' changes shapes"), std::string::npos);
}

TEST(GltfExtensions, InstancesOfAMeshAreShownBelowItsNode) {
    GltfBuilder builder;
    const int mesh = builder.add_triangle();
    const int places = builder.add_accessor<float>({0, 0, 0, 3, 0, 0, 0, 0, 5}, "VEC3");
    // About z by 0, 90 and 0 degrees.
    const float half = std::sqrt(0.5f);
    const int turns =
        builder.add_accessor<float>({0, 0, 0, 1, 0, 0, half, half, 0, 0, 0, 1}, "VEC4");
    const int sizes = builder.add_accessor<float>({1, 1, 1, 2, 2, 2, 1, 1, -1}, "VEC3");
    builder.add(
        "nodes",
        {{"mesh", mesh},
         {"translation", {10, 0, 0}},
         {"extensions",
          {{"EXT_mesh_gpu_instancing",
            {{"attributes", {{"TRANSLATION", places}, {"ROTATION", turns}, {"SCALE", sizes}}}}}}}});
    builder.json["extensionsRequired"] = {"EXT_mesh_gpu_instancing"};
    builder.add_animation(0, "translation", {0, 1},
                          builder.add_accessor<float>({10, 0, 0, 20, 0, 0}, "VEC3"));
    const OpenedGltf scene(builder.gltf(), {.fps = 1});
    EXPECT_TRUE(scene.warnings().empty());
    ASSERT_EQ(scene.animation().topology().triangles.size(), 3u);
    const std::vector<vec3> first = scene.at(0);
    ASSERT_EQ(first.size(), 9u);
    expect_point(first[1], 11, 0, 0);
    expect_point(first[3], 13, 0, 0);
    expect_point(first[4], 13, 2, 0);
    expect_point(first[6], 10, 0, 5);
    // The third one is mirrored.
    EXPECT_EQ(scene.animation().topology().triangles[0], uvec3(0, 1, 2));
    EXPECT_EQ(scene.animation().topology().triangles[2], uvec3(6, 8, 7));
    expect_point(scene.at(1)[4], 23, 2, 0);

    builder.json["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"]["SCALE"] =
        builder.add_accessor<float>({1, 1, 1}, "VEC3");
    EXPECT_NE(gltf_error(builder.gltf()).find("has 1 elements, but another attribute 3"),
              std::string::npos);
    // Instances are no nodes of the file.
    builder.json["nodes"][0].erase("extensions");
    builder.json["scenes"] = {{{"nodes", {1}}}};
    EXPECT_NE(gltf_error(builder.gltf()).find("scenes[0].nodes[0]"), std::string::npos);
}

/// The points of a texture that a triangle shows whose (u, v) are (0, 0), (1, 0) and (0.25, 0.5)
/// in the file, v from the top.
Texcoords shown_with(const Json& texture_info) {
    GltfBuilder builder;
    const int positions = builder.add_accessor<float>({0, 0, 0, 1, 0, 0, 0, 1, 0}, "VEC3");
    const int texcoords = builder.add_accessor<float>({0, 0, 1, 0, 0.25f, 0.5f}, "VEC2");
    const int others = builder.add_accessor<float>({9, 9, 9, 9, 9, 9}, "VEC2");
    const int mesh = builder.add_mesh(
        {{"POSITION", positions}, {"TEXCOORD_0", texcoords}, {"TEXCOORD_1", others}},
        {{"material", 0}});
    builder.add("nodes", {{"mesh", mesh}});
    Json info = {{"index", 0}};
    info.update(texture_info);
    builder.json["materials"] = {{{"pbrMetallicRoughness", {{"baseColorTexture", info}}}}};
    builder.json["textures"] = {{{"source", 0}}};
    builder.json["images"] = {{{"uri", "data:image/png;base64,AQIDBAU="}}};
    const OpenedGltf scene(builder.gltf());
    EXPECT_TRUE(scene.warnings().empty());
    return scene.animation().textures()->texcoords.at(0);
}

Json transformed(const Json& transform) {
    return {{"extensions", {{"KHR_texture_transform", transform}}}};
}

TEST(GltfTextureTransform, ScalesTurnsAndMoves) {
    const Texcoords plain = {Texcoord{0, 1}, {1, 1}, {0.25f, 0.5f}};
    EXPECT_EQ(shown_with(Json::object()), plain);
    EXPECT_EQ(shown_with(transformed(Json::object())), plain);
    EXPECT_EQ(shown_with(transformed({{"offset", {0.5, 0.25}}})),
              (Texcoords{Texcoord{0.5f, 0.75f}, {1.5f, 0.75f}, {0.75f, 0.25f}}));
    EXPECT_EQ(shown_with(transformed({{"offset", {0, 1}}, {"scale", {2, -1}}})),
              (Texcoords{Texcoord{0, 0}, {2, 0}, {0.5f, 0.5f}}));
    // The example of the extension: the lower left quarter of the image, turned.
    const Texcoords turned = shown_with(
        transformed({{"offset", {0, 1}}, {"rotation", 1.5707963267948966}, {"scale", {0.5, 0.5}}}));
    const Texcoords expected = {Texcoord{0, 0}, {0, 0.5f}, {0.25f, 0.125f}};
    for (std::size_t i = 0; i < 3; ++i) {
        EXPECT_EQ(turned[i].u, expected[i].u) << i;
        EXPECT_EQ(turned[i].v, expected[i].v) << i;
    }
}

TEST(GltfTextureTransform, MayNameOtherCoordinates) {
    Json info = transformed({{"texCoord", 0}});
    info["texCoord"] = 1;
    EXPECT_EQ(shown_with(info)[0], (Texcoord{0, 1}));
    info["extensions"] = Json::object();
    EXPECT_EQ(shown_with(info)[0], (Texcoord{9, -8}));
}

}  // namespace
}  // namespace mray
