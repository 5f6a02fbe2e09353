// Extensions that glTF files use and require.
#include <gtest/gtest.h>

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
    builder.json["extensionsUsed"] = {"KHR_animation_pointer", "EXT_mesh_gpu_instancing",
                                      "KHR_lights_punctual", "KHR_node_visibility"};
    const OpenedGltf used(builder.gltf());
    ASSERT_EQ(used.warnings().size(), 3u);
    EXPECT_NE(used.warnings()[0].find("'KHR_animation_pointer' changes shapes"), std::string::npos);
    EXPECT_NE(used.warnings()[1].find("'EXT_mesh_gpu_instancing' changes shapes"),
              std::string::npos);
    EXPECT_NE(used.warnings()[2].find("'KHR_node_visibility' changes shapes"), std::string::npos);
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
