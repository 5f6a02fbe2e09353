// Materials and textures of glTF files.
#include <gtest/gtest.h>

#include <functional>

#include "scenes/mesh/mesh_file.h"
#include "tests/scenes/gltf/gltf_builder.h"
#include "tests/scenes/gltf/opened_gltf.h"

namespace mray {
namespace {

using namespace test;

TEST(GltfMaterials, BaseColourIsTheAlbedo) {
    GltfBuilder builder = triangle_file();
    EXPECT_EQ(OpenedGltf(builder.gltf()).animation().topology().albedo[0], kClay);
    builder.json["materials"] = {{{"pbrMetallicRoughness", {{"baseColorFactor", {1, 0.5, 0, 1}}}}}};
    builder.json["meshes"][0]["primitives"][0]["material"] = 0;
    EXPECT_EQ(OpenedGltf(builder.gltf()).animation().topology().albedo[0], 0x0080FFu);
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
    const SceneTextures* textures = scene.animation().textures();
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
    EXPECT_EQ(outside.animation().textures(), nullptr);
    ASSERT_EQ(outside.warnings().size(), 1u);
    EXPECT_NE(outside.warnings()[0].find("outside of the scene's folder"), std::string::npos);
}

TEST(GltfMaterials, TexturesInDataUris) {
    GltfBuilder builder = textured_triangle();
    builder.json["images"] = {{{"uri", "data:image/png;base64,AQIDBAU%3d"}}};
    // Another one repeats the same image.
    builder.add("textures", {{"source", 0}});
    builder.json["materials"].push_back(
        {{"pbrMetallicRoughness", {{"baseColorTexture", {{"index", 1}}}}}});
    const OpenedGltf scene(builder.gltf());
    EXPECT_TRUE(scene.warnings().empty());
    ASSERT_NE(scene.animation().textures(), nullptr);
    const std::vector<TextureFile>& files = scene.animation().textures()->files;
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

TEST(GltfMaterials, TexturesInDataUrisThatCannotBeReadAreLeftOut) {
    GltfBuilder builder = textured_triangle();
    for (const auto& [uri, warning] :
         {std::pair{"data:image/png,abc", "is a data: URI that is not in base 64"},
          {"data:image/png;base64,ab*d", "has characters that are not base 64, or is cut"},
          {"data:image/png;base64,AQI", "has characters that are not base 64, or is cut"},
          {"data:image/png;base64,", "has no bytes"}}) {
        builder.json["images"] = {{{"uri", uri}}};
        const OpenedGltf scene(builder.gltf());
        EXPECT_EQ(scene.animation().textures(), nullptr);
        ASSERT_EQ(scene.warnings().size(), 1u) << uri;
        EXPECT_NE(scene.warnings()[0].find(std::string("scene.gltf: warning: images[0].uri: ") +
                                           warning + "; its triangles have their colour alone"),
                  std::string::npos)
            << scene.warnings()[0];
    }
}

TEST(GltfMaterials, WhatDoesNotFitIsLeftOutAndItsTrianglesAreNot) {
    const std::vector<std::pair<std::function<void(Json&)>, const char*>> changes = {
        {[](Json& j) { j["meshes"][0]["primitives"][0]["material"] = 7; },
         "primitives[0].material: is 7, but there are 1 materials; left out"},
        {[](Json& j) { j["meshes"][0]["primitives"][0]["attributes"]["NORMAL"] = 9; },
         "attributes.NORMAL: is 9, but there are 2 accessors; left out"},
        {[](Json& j) { j["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_0"] = 0; },
         "accessors[0].type: must be VEC2 here; left out"},
        {[](Json& j) { j["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"] = 0; },
         "attributes.COLOR_0: colours of vertices are not read; left out"},
        {[](Json& j) { j["textures"][0]["source"] = 3; }, "textures[0].source: is 3, but there"},
        {[](Json& j) { j["textures"][0]["sampler"] = 3; }, "textures[0].sampler: is 3, but there"},
        {[](Json& j) {
             j["images"][0] = {{"bufferView", 99}};
         },
         "images[0].bufferView: is 99"},
        {[](Json& j) { j["images"][0] = 5; }, "images[0]: must be an object"},
        {[](Json& j) { j["materials"][0] = Json::array(); }, "materials[0]: must be an object"},
        {[](Json& j) { j["materials"][0]["alphaMode"] = 1; },
         "materials[0].alphaMode: must be a string; its triangles have their colour alone"}};
    GltfBuilder builder = textured_triangle();
    builder.json["images"] = {{{"uri", "data:image/png;base64,AQIDBAU="}}};
    const Json good = Json::parse(builder.gltf());
    for (const auto& [change, warning] : changes) {
        Json json = good;
        change(json);
        const OpenedGltf scene(json.dump());
        EXPECT_EQ(scene.animation().topology().triangles.size(), 1u);
        ASSERT_EQ(scene.warnings().size(), 1u) << warning;
        EXPECT_NE(scene.warnings()[0].find(warning), std::string::npos) << scene.warnings()[0];
    }
}

TEST(GltfMaterials, MasksAreWhereAlphaTimesTheFactorIsBelowTheCutoff) {
    GltfBuilder builder = textured_triangle();
    builder.json["images"] = {{{"uri", "data:image/png;base64,AQIDBAU="}}};
    Json& material = builder.json["materials"][0];
    const auto cutoff = [&] {
        const OpenedGltf scene(builder.gltf());
        EXPECT_TRUE(scene.warnings().empty());
        return scene.animation().textures()->files.at(0).alpha_cutoff;
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
    ASSERT_EQ(both.animation().textures()->files.size(), 2u);
    EXPECT_EQ(both.animation().textures()->files[0].alpha_cutoff, 0.5f);
    EXPECT_EQ(both.animation().textures()->files[1].alpha_cutoff, 0);
    EXPECT_EQ(both.animation().textures()->texture_ids, (std::vector<std::uint32_t>{0, 1}));
}

}  // namespace
}  // namespace mray
