// Files of reports by users of other tools: their triangles and colours.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "tests/scenes/opened_scene.h"
#include "tests/scenes/ply/ply_files.h"

namespace mray::test {
namespace {

constexpr Albedo kRed = 0x0000FF;

struct Opened : OpenedScene {
    Opened(const TemporaryFolder& folder, const char* name, const std::string& bytes)
        : OpenedScene(folder.write(name, bytes)) {}

    const std::vector<uvec3>& triangles() const { return topology().triangles; }
    const std::vector<Albedo>& albedo() const { return topology().albedo; }
    std::string all_warnings() const { return fmt::format("{}", fmt::join(warnings, "\n")); }
};

TEST(FileReports, ANodeOfAGltfFileFarAwayHidesNoOther) {
    const TemporaryFolder folder;
    for (const char* translations : {R"([0, 0, 0]}, {"mesh": 0, "translation": [1e20, 0, 0])",
                                     R"([1e20, 0, 0]}, {"mesh": 0, "translation": [0, 0, 0])"}) {
        const Opened opened(
            folder, "a.gltf",
            std::string(R"({"asset": {"version": "2.0"}, "scenes": [{"nodes": [0, 1]}],
            "nodes": [{"mesh": 0, "translation": )") +
                translations + R"(}], "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
            "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}],
            "bufferViews": [{"buffer": 0, "byteLength": 36}], "buffers": [{"byteLength": 36,
            "uri": "data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA"}]})");
        EXPECT_EQ(opened.animation->bounds().upper, glm::dvec3(1, 1, 0)) << translations;
    }
}

/// A square of this colour in linear floats, of vertices or of faces.
std::string coloured_square(const std::string& type, const std::vector<std::string>& names,
                            const std::vector<double>& colour, bool of_faces = false) {
    PlyItems vertices = ply_vertices({{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}});
    PlyItems faces = ply_faces({{3, 0, 1, 2}, {2, 0, 1}, {3, 0, 2, 3}});
    PlyItems& part = of_faces ? faces : vertices;
    for (const std::string& name : names) part.properties.push_back(type + ' ' + name);
    for (std::vector<double>& item : part.items)
        item.insert(item.end(), colour.begin(), colour.end());
    return ply(PlyEncoding::kText, {vertices, faces});
}

TEST(FileReports, Assimp669ColoursOfPlyFilesInEverySpelling) {
    const TemporaryFolder folder;
    const std::vector<std::string> names = {"red", "green", "blue"};
    // (128 / 255)^2 * 255 and (64 / 255)^2 * 255.
    const std::vector<Albedo> right(2, 64u | 16u << 8);
    const auto colours = [&](const std::string& bytes) {
        const Opened opened(folder, "a.ply", bytes);
        EXPECT_EQ(opened.triangles().size(), 2u);
        return opened.albedo();
    };
    EXPECT_EQ(colours(coloured_square("uchar", names, {128, 64, 0})), right);
    EXPECT_EQ(colours(coloured_square("ushort", names, {128 * 257, 64 * 257, 0})), right);
    EXPECT_EQ(colours(coloured_square("short", names, {128, 64, 0})), right);
    EXPECT_EQ(colours(coloured_square("float", names, {0.2520, 0.0630, 0})), right);
    EXPECT_EQ(colours(coloured_square("uchar", {"r", "g", "b"}, {128, 64, 0})), right);
    EXPECT_EQ(colours(coloured_square("uchar", {"diffuse_red", "diffuse_green", "diffuse_blue"},
                                      {128, 64, 0})),
              right);
    EXPECT_EQ(colours(coloured_square("uchar", names, {128, 64, 0}, true)), right);
}

TEST(FileReports, Assimp669ColoursOutOfRangeAreWarnings) {
    const TemporaryFolder folder;
    for (const auto& [type, value, warning] :
         {std::tuple("float", 128.0, "a.ply:13: warning: colour 128 is not from 0 to 1; clamped"),
          std::tuple("int", 256.0, "a.ply:13: warning: colour 256 is not from 0 to 255; clamped"),
          std::tuple("double", std::nan(""),
                     "a.ply:13: warning: colour nan is not from 0 to 1; clamped")}) {
        const Opened opened(folder, "a.ply",
                            coloured_square(type, {"red", "green", "blue"}, {value, 0, 0}));
        EXPECT_EQ(opened.albedo(), std::vector<Albedo>(2, std::isnan(value) ? 0 : kRed));
        EXPECT_TRUE(has(opened.all_warnings(), warning));
    }
    std::string textured = coloured_square("uchar", {"q", "r", "s"}, {0, 0, 0});
    textured.insert(textured.find("element"), "comment TextureFile a.png\n");
    EXPECT_TRUE(has(Opened(folder, "a.ply", textured).all_warnings(), "textures of PLY files"));
}

/// A square with these words after the coordinates of each vertex.
std::string obj_square(const std::string& more) {
    return fmt::format("v -1 -1 0{0}\nv 1 -1 0{0}\nv 1 1 0{0}\nv -1 1 0{0}\nf 1 2 3 4\n", more);
}

TEST(FileReports, Three11422ColoursOfVerticesInObjFiles) {
    const TemporaryFolder folder;
    const auto opened = [&](const std::string& file) { return Opened(folder, "a.obj", file); };
    EXPECT_EQ(opened(obj_square(" 1 0 0")).albedo(), std::vector<Albedo>(2, kRed));
    // As in images.
    EXPECT_EQ(opened(obj_square(" 0.5 0 0")).albedo(), std::vector<Albedo>(2, 64));
    for (const char* weight : {"", " 1", " 2"}) {
        EXPECT_EQ(opened(obj_square(weight)).albedo(), std::vector<Albedo>(2, kClay));
        EXPECT_TRUE(opened(obj_square(weight)).warnings.empty());
    }
    for (const auto& [file, warning] :
         {std::pair(obj_square(" 1 0"), "a.obj:1: warning: vertex of 5 numbers"),
          std::pair(obj_square(" 1 0 0 1"), "a.obj:1: warning: vertex of 7 numbers"),
          std::pair(obj_square(" 255 0 0"), "a.obj:1: warning: colour 255 is not from 0 to 1"),
          std::pair(obj_square("") + "#MRGB FFFF0000\n",
                    "a.obj:6: warning: colours of #MRGB are not read; write v x y z r g b")})
        EXPECT_TRUE(has(opened(file).all_warnings(), warning));
    // Materials decide where there are some.
    folder.write("a.mtl", "newmtl green\nKd 0 1 0\n");
    const std::string mixed = obj_square(" 1 0 0") + "mtllib a.mtl\nusemtl green\nf 1 2 3\n";
    EXPECT_EQ(opened(mixed).albedo(), (std::vector<Albedo>{kRed, kRed, 0x00FF00}));
}

TEST(FileReports, Meshlab66NamesOfLibrariesWithBlanksAndBackslashes) {
    const TemporaryFolder folder;
    folder.write("barn wall v2.mtl", "newmtl paint\nKd 1 0 0\n");
    folder.write("lib/one.mtl", "newmtl paint\nKd 1 0 0\n");
    for (const char* names :
         {"barn wall v2.mtl", "\"barn wall v2.mtl\"", "barn\\ wall\\ v2.mtl ", ".\\lib\\one.mtl",
          "lib\\one.mtl # a comment", "C:\\x\\barn wall v2.mtl"}) {
        const Opened opened(folder, "a.obj",
                            fmt::format("mtllib {}\nusemtl paint\n", names) + obj_square(""));
        EXPECT_EQ(opened.albedo(), std::vector<Albedo>(2, kRed)) << names;
        EXPECT_TRUE(opened.warnings.empty()) << names << ": " << opened.all_warnings();
    }
    // What cannot be read is a warning: a triangle needs no colour.
    folder.write("bad.mtl", std::string("newmtl paint\n\0\1", 15));
    const Opened bad(folder, "a.obj", "mtllib bad.mtl\nmtllib none.mtl\n" + obj_square(""));
    EXPECT_EQ(bad.warnings.size(), 1u);
    EXPECT_TRUE(has(bad.all_warnings(), "control character 0x00"));
    EXPECT_TRUE(has(bad.all_warnings(), "its materials are clay (and 1 more)"));
}

TEST(FileReports, Cjio192AFaceThatCrossesItselfIsNamedWithItsLine) {
    const TemporaryFolder folder;
    const Opened bow_ties(folder, "polygons.obj",
                          "v 0 0 0\nv 2 0 0\nv 2 2 0\nv 0 2 0\n"
                          "f 1 2 3\nf 1 2 3 4\nf 1 3 2 4\nf 1 3 4 2\n");
    EXPECT_EQ(bow_ties.triangles().size(), 7u);
    ASSERT_EQ(bow_ties.warnings.size(), 1u);
    EXPECT_TRUE(has(bow_ties.warnings[0], "polygons.obj:7: warning: face crosses itself"));
    EXPECT_TRUE(bow_ties.warnings[0].ends_with("(and 1 more)"));
}

}  // namespace
}  // namespace mray::test
