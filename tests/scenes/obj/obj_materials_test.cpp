// Colours and textures of OBJ files from material libraries.
#include <gtest/gtest.h>

#include "scenes/animation.h"
#include "scenes/obj/obj_reader.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/thrown_error.h"

namespace mray {
namespace {

using namespace test;
namespace fs = std::filesystem;

const std::string kVertices = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
const std::string kTriangle = kVertices + "f 1 2 3\n";
const std::string kSquare = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n";
const std::string kFace = "f 1/1 2/2 3/3 4/4\n";
constexpr Albedo kWhite = 0xFFFFFF;

struct Reading {
    FileMesh mesh;
    std::vector<std::string> warnings;
};

Reading read_in(const TemporaryFolder& folder, const std::string& text,
                const std::string& name = "a.obj") {
    Reading result;
    MeshFileOptions options;
    options.warn = [&](const Warning& warning) { result.warnings.push_back(warning.line()); };
    result.mesh = read_obj(folder.write(name, text), options);
    return result;
}

TEST(ObjMaterials, DiffuseColourBecomesTheAlbedoOfTheFacesAfterIt) {
    const TemporaryFolder folder;
    folder.write("a.mtl", "newmtl red\nKd 1 0 0\nnewmtl blue  \r\n  Kd 0 0 0.5\n");
    const Reading result = read_in(
        folder, "mtllib a.mtl\n" + kTriangle +
                    "usemtl red\nf 1 2 3\nf 1 2 3\nusemtl  blue \nf 1 2 3\nusemtl red\nf 3 2 1\n");
    EXPECT_EQ(result.mesh.albedo,
              (std::vector<Albedo>{kClay, 0x0000FF, 0x0000FF, 0x800000, 0x0000FF}));
    EXPECT_TRUE(result.warnings.empty());
}
TEST(ObjMaterials, AllLibrariesOfALineAreRead) {
    const TemporaryFolder folder;
    folder.write("a.mtl", "newmtl a\nKd 1 0 0\n");
    folder.write("b c.mtl", "newmtl b\nKd 0 1 0\n");
    const Reading result = read_in(folder, "mtllib none.mtl a.mtl b\\ c.mtl \n" + kVertices +
                                               "usemtl a\nf 1 2 3\nusemtl b\nf 1 2 3\n");
    EXPECT_EQ(result.mesh.albedo, (std::vector<Albedo>{0x0000FF, 0x00FF00}));
    EXPECT_EQ(result.warnings.size(), 1u);
}
TEST(ObjMaterials, MissingLibraryAndMaterialAreWarnings) {
    const TemporaryFolder folder;
    const Reading result = read_in(folder, "mtllib none.mtl\n" + kVertices + "usemtl q\nf 1 2 3\n");
    EXPECT_EQ(result.mesh.albedo, std::vector<Albedo>{kClay});
    ASSERT_EQ(result.warnings.size(), 2u);
    EXPECT_NE(result.warnings[0].find("a.obj: warning: "), std::string::npos);
    EXPECT_NE(result.warnings[0].find("none.mtl: no such file"), std::string::npos);
    EXPECT_NE(result.warnings[1].find("'q'"), std::string::npos);
}
TEST(ObjMaterials, LibraryOutsideOfTheFolderIsNotOpened) {
    const TemporaryFolder folder;
    folder.write("outside.mtl", "newmtl a\nKd 1 0 0\n");
    const TemporaryFolder other;
    const fs::path absolute = other.write("abs.mtl", "newmtl a\nKd 1 0 0\n");
    for (const std::string& name :
         {std::string("../outside.mtl"), std::string("../../../etc/passwd"), absolute.native()}) {
        const Reading result = read_in(
            folder, "mtllib " + name + "\n" + kVertices + "usemtl a\nf 1 2 3\n", "scene/a.obj");
        EXPECT_EQ(result.mesh.albedo[0], kClay);
        ASSERT_FALSE(result.warnings.empty());
        EXPECT_NE(result.warnings[0].find("not followed"), std::string::npos) << result.warnings[0];
    }
}

/// A folder with a.mtl, whose material `m` has these statements, and the images a.png and b.png.
struct Folder : TemporaryFolder {
    explicit Folder(const std::string& material) {
        write("a.mtl", "newmtl m\n" + material);
        write("a.png", "-");
        write("b.png", "-");
    }
};

TEST(ObjTextures, FacesHaveTheTextureOfTheirMaterialAndTheCoordinatesOfTheirCorners) {
    const Folder folder("map_Kd a.png\nnewmtl n\nKd 1 0 0\nmap_Kd b.png\nnewmtl p\nKd 0 1 0\n");
    const Reading result = read_in(folder, "mtllib a.mtl\n" + kSquare + kFace + "usemtl m\n" +
                                               kFace + "usemtl n\nf -4/-1 -3/-2 -2/-3\nusemtl p\n" +
                                               kFace + "usemtl m\n" + kFace);
    EXPECT_TRUE(result.warnings.empty());
    const FileMesh& mesh = result.mesh;
    ASSERT_EQ(mesh.textures.size(), 2u);
    EXPECT_EQ(mesh.textures[0].path, fs::canonical(folder.path() / "a.png").native());
    EXPECT_EQ(mesh.face_textures, (std::vector<std::uint32_t>{kNoTexture, 0, 1, kNoTexture, 0}));
    EXPECT_EQ(mesh.albedo, (std::vector<Albedo>{kClay, kWhite, 0xFF, 0xFF00, kWhite}));
    ASSERT_EQ(mesh.texcoords.size(), 19u);
    EXPECT_EQ(mesh.texcoords[1], (Texcoord{0, 0}));  // has no texture
    EXPECT_EQ(mesh.texcoords[5], (Texcoord{1, 0}));
    EXPECT_EQ(mesh.texcoords[8], (Texcoord{0, 1}));
    EXPECT_EQ(mesh.texcoords[9], (Texcoord{1, 1}));
}

TEST(ObjTextures, ScaleAndOffsetChangeCoordinates) {
    const Folder folder("map_Kd -s 2 4 1 -o 0.5 -1 0 a.png\n");
    const FileMesh mesh = read_in(folder, "mtllib a.mtl\nusemtl m\n" + kSquare + kFace).mesh;
    EXPECT_EQ(mesh.texcoords[2], (Texcoord{2.5f, 3}));
    EXPECT_EQ(mesh.texcoords[0], (Texcoord{0.5f, -1}));
}

TEST(ObjTextures, OneFileIsOneTextureUnlessItClamps) {
    const Folder folder(
        "map_Kd a.png\nnewmtl n\nmap_Kd ./a.png\nnewmtl o\nmap_Kd -clamp on a.png\n");
    const FileMesh mesh = read_in(folder, "mtllib a.mtl\n" + kSquare + "usemtl m\n" + kFace +
                                              "usemtl n\n" + kFace + "usemtl o\n" + kFace)
                              .mesh;
    ASSERT_EQ(mesh.textures.size(), 2u);
    EXPECT_FALSE(mesh.textures[0].clamp);
    EXPECT_TRUE(mesh.textures[1].clamp);
    EXPECT_EQ(mesh.face_textures, (std::vector<std::uint32_t>{0, 0, 1}));
}

TEST(ObjTextures, MissingFileIsAWarningAndLeavesTheColour) {
    const Folder folder("Kd 0 0 1\nmap_Kd none.png\nnewmtl n\nmap_Kd none.png\n");
    const Reading result = read_in(
        folder, "mtllib a.mtl\n" + kSquare + "usemtl m\n" + kFace + kFace + "usemtl n\n" + kFace);
    EXPECT_TRUE(result.mesh.textures.empty());
    EXPECT_EQ(result.mesh.albedo, (std::vector<Albedo>{0xFF0000, 0xFF0000, kClay}));
    ASSERT_EQ(result.warnings.size(), 1u);
    EXPECT_NE(result.warnings[0].find("a.mtl: warning: map_Kd: "), std::string::npos);
    EXPECT_NE(result.warnings[0].find("none.png: no such file"), std::string::npos)
        << result.warnings[0];
}

TEST(ObjTextures, FileOfAnotherFolderIsSearchedBesideTheLibraryAndNowhereElse) {
    const TemporaryFolder folder;
    folder.write("secret.png", "-");
    folder.write("scene/a.png", "-");
    folder.write("scene/a.mtl",
                 "newmtl m\nmap_Kd C:\\maps\\a.png\nnewmtl n\nmap_Kd ../secret.png\n"
                 "newmtl o\nmap_Kd /etc/passwd\n");
    const auto [mesh, warnings] = read_in(folder,
                                          "mtllib a.mtl\n" + kSquare + "usemtl m\n" + kFace +
                                              "usemtl n\n" + kFace + "usemtl o\n" + kFace,
                                          "scene/a.obj");
    EXPECT_EQ(mesh.face_textures, (std::vector<std::uint32_t>{0, kNoTexture, kNoTexture}));
    ASSERT_EQ(mesh.textures.size(), 1u);
    EXPECT_EQ(fs::path(mesh.textures[0].path).filename(), "a.png");
    ASSERT_EQ(warnings.size(), 1u);
    EXPECT_NE(warnings[0].find("not followed"), std::string::npos) << warnings[0];
    EXPECT_NE(warnings[0].find("(and 1 more)"), std::string::npos) << warnings[0];
}

TEST(ObjTextures, FacesWithoutCoordinatesHaveTheirColourAlone) {
    const Folder folder("Kd 1 0 0\nmap_Kd a.png\n");
    const Reading result = read_in(folder, "mtllib a.mtl\nusemtl m\n" + kSquare + "f 1/1 2/2 3\n" +
                                               "f 1//1 2//1 3//1\nf 1/9 2/9 3/9\n" + kFace);
    EXPECT_EQ(result.mesh.face_textures,
              (std::vector<std::uint32_t>{kNoTexture, kNoTexture, kNoTexture, 0}));
    ASSERT_EQ(result.warnings.size(), 1u);
    EXPECT_NE(result.warnings[0].find("without texture coordinates"), std::string::npos);
    EXPECT_NE(result.warnings[0].find("(and 2 more)"), std::string::npos);
}

TEST(ObjTextures, OfASequenceAreThoseOfItsFirstFile) {
    const Folder folder("map_Kd a.png\n");
    // A concave polygon, whose triangles are no fan.
    const std::string face = "f 1/1 2/2 3/3 4/4 5/5\n";
    const std::string texcoords = "vt 0 0\nvt 4 0\nvt 4 4\nvt 2 1\nvt 0 4\n";
    const auto positions = [](int z) {
        std::string text;
        for (const char* xy : {"0 0", "4 0", "4 4", "2 1", "0 4"})
            text += std::string("v ") + xy + " " + std::to_string(z) + "\n";
        return text;
    };
    folder.write("f_1.obj", "mtllib a.mtl\nusemtl m\n" + positions(0) + texcoords + face);
    folder.write("f_2.obj", positions(1) + "f 1 2 3 4 5\n");
    const auto animation = open_scene(folder.file("f_%d.obj"));
    ASSERT_NE(animation->textures(), nullptr);
    const SceneTextures& textures = *animation->textures();
    EXPECT_EQ(textures.files.size(), 1u);
    EXPECT_EQ(textures.texture_ids, (std::vector<std::uint32_t>{0, 0, 0}));
    ASSERT_EQ(textures.texcoords.size(), 3u);
    std::vector<vec3> points(5);
    animation->positions(1, points);
    for (std::size_t i = 0; i < 3; ++i) {
        for (int k = 0; k < 3; ++k) {
            const vec3 p = points[animation->topology().triangles[i][k]];
            EXPECT_EQ(textures.texcoords[i][static_cast<std::size_t>(k)], (Texcoord{p.x, p.y}));
        }
    }
}

}  // namespace
}  // namespace mray
