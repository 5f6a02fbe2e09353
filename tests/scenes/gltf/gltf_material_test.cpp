// Materials, textures and extensions of glTF files.
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "scenes/mesh/mesh_file.h"
#include "tests/scenes/gltf/gltf_builder.h"
#include "tests/scenes/gltf/opened_gltf.h"

namespace mray {
namespace {

using namespace test;

TEST(GltfMaterials, BaseColourIsTheAlbedo) {
    GltfBuilder builder = triangle_file();
    EXPECT_EQ(OpenedGltf(builder.gltf()).topology().albedo[0], kClay);
    builder.json["materials"] = {{{"pbrMetallicRoughness", {{"baseColorFactor", {1, 0.5, 0, 1}}}}}};
    builder.json["meshes"][0]["primitives"][0]["material"] = 0;
    EXPECT_EQ(OpenedGltf(builder.gltf()).topology().albedo[0], 0x0080FFu);
}

/// The triangle with texture coordinates and a clamped texture of images[0], which is not there.
GltfBuilder textured_triangle() {
    GltfBuilder builder;
    const int mesh = builder.add_mesh(
        {{"POSITION", builder.add_accessor<float>({0, 0, 0, 1, 0, 0, 0, 1, 0}, "VEC3")},
         {"TEXCOORD_0", builder.add_accessor<std::uint8_t>({0, 0, 255, 0, 0, 255}, "VEC2", true)}},
        {{"material", 0}});
    builder.add("nodes", {{"mesh", mesh}});
    builder.json["materials"] = {
        {{"pbrMetallicRoughness", {{"baseColorTexture", {{"index", 0}}}}}}};
    builder.json["textures"] = {{{"source", 0}, {"sampler", 0}}};
    builder.json["samplers"] = {{{"wrapS", 33071}, {"wrapT", 33071}}};
    return builder;
}

TEST(GltfMaterials, TexturesAreFilesOrPartsOfTheBuffer) {
    GltfBuilder builder = textured_triangle();
    const int view = builder.add_view<std::uint8_t>({1, 2, 3, 4, 5});
    builder.json["images"] = {{{"bufferView", view}, {"mimeType", "image/png"}}};
    const std::string glb = builder.glb();
    const OpenedGltf scene(glb, {}, "scene.glb");
    const SceneTextures* textures = scene.animation->textures();
    ASSERT_NE(textures, nullptr);
    ASSERT_EQ(textures->files.size(), 1u);
    EXPECT_TRUE(textures->files[0].clamp);
    EXPECT_EQ(textures->files[0].place, "images[0]");
    EXPECT_EQ(textures->files[0].content, nullptr);
    EXPECT_EQ(glb.substr(textures->files[0].offset, textures->files[0].size),
              std::string("\1\2\3\4\5"));
    // v counts from the bottom here.
    EXPECT_EQ(textures->texcoords[0], (Texcoords{Texcoord{0, 1}, {1, 1}, {0, 0}}));
    EXPECT_EQ(textures->texture_ids, std::vector<std::uint32_t>{0});

    builder.json["images"] = {{{"uri", "../colours.png"}}};
    const OpenedGltf outside(builder.glb(), {}, "scene.glb");
    EXPECT_EQ(outside.animation->textures(), nullptr);
    ASSERT_EQ(outside.warnings.size(), 1u);
    EXPECT_TRUE(has(outside.warnings[0], "outside of the scene's folder"));
}

TEST(GltfMaterials, TexturesInDataUris) {
    GltfBuilder builder = textured_triangle();
    builder.json["images"] = {{{"uri", "data:image/png;base64,AQIDBAU%3d"}}};
    // Another one repeats the same image.
    builder.add("textures", {{"source", 0}});
    builder.json["materials"].push_back(
        {{"pbrMetallicRoughness", {{"baseColorTexture", {{"index", 1}}}}}});
    const OpenedGltf scene(builder.gltf());
    EXPECT_TRUE(scene.warnings.empty());
    ASSERT_NE(scene.animation->textures(), nullptr);
    const std::vector<TextureFile>& files = scene.animation->textures()->files;
    ASSERT_EQ(files.size(), 2u);
    ASSERT_NE(files[0].content, nullptr);
    EXPECT_EQ(*files[0].content, std::string("\1\2\3\4\5"));
    EXPECT_EQ(files[0].offset, 0u);
    EXPECT_EQ(files[0].size, 5u);
    EXPECT_EQ(files[0].place, "images[0].uri");
    EXPECT_TRUE(files[0].clamp);
    EXPECT_FALSE(files[1].clamp);
    EXPECT_EQ(files[1].content, files[0].content) << "one copy of the bytes";
}

TEST(GltfMaterials, WhatDoesNotFitIsLeftOutAndItsTrianglesAreNot) {
    const struct {
        const char* pointer;
        const char* value;
        const char* warning;
    } changes[] = {
        {"/meshes/0/primitives/0/material", "7",
         "primitives[0].material: is 7, but there are 1 materials; left out"},
        {"/meshes/0/primitives/0/attributes/NORMAL", "9",
         "attributes.NORMAL: is 9, but there are 2 accessors; left out"},
        {"/meshes/0/primitives/0/attributes/TEXCOORD_0", "0",
         "accessors[0].type: is 'VEC3'; must be VEC2 here; left out"},
        {"/meshes/0/primitives/0/attributes/COLOR_0", "0",
         "attributes.COLOR_0: colours of vertices are not read; left out"},
        {"/textures/0/source", "3", "textures[0].source: is 3, but there"},
        {"/textures/0/sampler", "3", "textures[0].sampler: is 3, but there"},
        {"/images/0", R"({"bufferView": 99})", "images[0].bufferView: is 99"},
        {"/images/0", "5", "images[0]: must be an object"},
        {"/images/0/uri", R"("data:image/png,abc")",
         "images[0].uri: is a data: URI that is not in base 64; its triangles have their colour"},
        {"/images/0/uri", R"("data:image/png;base64,ab*d")",
         "images[0].uri: has characters that are not base 64, or is cut; its triangles have their"},
        {"/images/0/uri", R"("data:image/png;base64,AQI")",
         "images[0].uri: has characters that are not base 64, or is cut; its triangles have their"},
        {"/images/0/uri", R"("data:image/png;base64,")",
         "images[0].uri: has no bytes; its triangles have their colour alone"},
        {"/materials/0", "[]", "materials[0]: must be an object"},
        {"/materials/0/alphaMode", "1",
         "materials[0].alphaMode: must be a string; its triangles have their colour alone"},
    };
    GltfBuilder builder = textured_triangle();
    builder.json["images"] = {{{"uri", "data:image/png;base64,AQIDBAU="}}};
    const Json good = Json::parse(builder.gltf());
    for (const auto& [pointer, value, warning] : changes) {
        const OpenedGltf scene(changed(good, pointer, value).dump());
        EXPECT_EQ(scene.topology().triangles.size(), 1u);
        ASSERT_EQ(scene.warnings.size(), 1u) << warning;
        EXPECT_TRUE(has(scene.warnings[0], warning));
        EXPECT_TRUE(scene.animation->textures() == nullptr ||
                    !has(scene.warnings[0], "have their colour"));
    }
}

TEST(GltfMaterials, MasksAreWhereAlphaTimesTheFactorIsBelowTheCutoff) {
    GltfBuilder builder = textured_triangle();
    builder.json["images"] = {{{"uri", "data:image/png;base64,AQIDBAU="}}};
    Json& material = builder.json["materials"][0];
    const auto cutoff = [&] {
        const OpenedGltf scene(builder.gltf());
        EXPECT_TRUE(scene.warnings.empty());
        return scene.animation->textures()->files.at(0).alpha_cutoff;
    };
    EXPECT_EQ(cutoff(), 0);
    material["alphaCutoff"] = 0.25;
    EXPECT_EQ(cutoff(), 0);
    material["alphaMode"] = "MASK";
    EXPECT_EQ(cutoff(), 0.25f);
    material["pbrMetallicRoughness"]["baseColorFactor"] = {1, 1, 1, 0.5};
    EXPECT_EQ(cutoff(), 0.5f);
    material.erase("alphaCutoff");
    EXPECT_EQ(cutoff(), 1);
    // Nothing is left of it.
    material["alphaCutoff"] = 0.75;
    EXPECT_EQ(gltf_error(builder.gltf()), "scene.gltf: its scene has no triangles");
    material["alphaMode"] = "OPAQUE";
    EXPECT_EQ(cutoff(), 0);
    // One image with and without holes is two textures.
    material["alphaMode"] = "MASK";
    material["alphaCutoff"] = 0.25;
    builder.json["materials"].push_back(material);
    builder.json["materials"][1].erase("alphaMode");
    builder.json["meshes"][0]["primitives"].push_back(
        Json(builder.json["meshes"][0]["primitives"][0]));
    builder.json["meshes"][0]["primitives"][1]["material"] = 1;
    const OpenedGltf both(builder.gltf());
    ASSERT_EQ(both.animation->textures()->files.size(), 2u);
    EXPECT_EQ(both.animation->textures()->files[0].alpha_cutoff, 0.5f);
    EXPECT_EQ(both.animation->textures()->files[1].alpha_cutoff, 0);
    EXPECT_EQ(both.animation->textures()->texture_ids, (std::vector<std::uint32_t>{0, 1}));
}

TEST(GltfExtensions, ThatDoNotConcernTrianglesAreLeftOutWithOneWarning) {
    GltfBuilder builder = triangle_file();
    builder.json["extensions"]["KHR_lights_punctual"]["lights"] = {{{"type", "point"}}};
    builder.json["nodes"][0]["extensions"]["KHR_lights_punctual"]["light"] = 0;
    builder.json["extensionsUsed"] = {"KHR_lights_punctual", "KHR_mesh_quantization"};
    const OpenedGltf used(builder.gltf());
    EXPECT_TRUE(used.warnings.empty());
    builder.json["extensionsRequired"] = {"KHR_mesh_quantization",   "KHR_lights_punctual",
                                          "KHR_materials_clearcoat", "KHR_materials_of_tomorrow",
                                          "EXT_texture_webp",        "KHR_texture_transform"};
    const OpenedGltf required(builder.gltf());
    EXPECT_EQ(required.at(0), used.at(0));
    ASSERT_EQ(required.warnings.size(), 1u);
    EXPECT_TRUE(has(required.warnings[0],
                    "scene.gltf: warning: extensionsRequired[1]: "
                    "'KHR_lights_punctual' is required, but not read; left "
                    "out"));
    EXPECT_TRUE(has(required.warnings[0], "3 more"));
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
    builder.json["extensionsUsed"] = {"EXT_mesh_gpu_instancing", "KHR_lights_punctual",
                                      "KHR_node_visibility"};
    const OpenedGltf used(builder.gltf());
    ASSERT_EQ(used.warnings.size(), 2u);
    EXPECT_TRUE(has(used.warnings[0], "'EXT_mesh_gpu_instancing' changes shapes"));
    EXPECT_TRUE(has(used.warnings[1], "'KHR_node_visibility' changes shapes"));
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
    EXPECT_TRUE(scene.warnings.empty());
    return scene.animation->textures()->texcoords.at(0);
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
