// Colours of OBJ files from material libraries.
#include <gtest/gtest.h>

#include "scenes/mesh/mesh_file.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/thrown_error.h"

namespace mray {
namespace {

using namespace test;
namespace fs = std::filesystem;

const std::string kVertices = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
const std::string kTriangle = kVertices + "f 1 2 3\n";

struct Coloured {
    std::vector<Albedo> albedo;
    std::vector<std::string> warnings;
};
Coloured read_coloured(const TemporaryFolder& folder, const std::string& text) {
    Coloured result;
    MeshFileOptions options;
    options.warn = [&](const Warning& warning) { result.warnings.push_back(warning.line()); };
    result.albedo = read_obj(folder.write("a.obj", text), options).albedo;
    return result;
}

TEST(ObjMaterials, DiffuseColourBecomesTheAlbedoOfTheFacesAfterIt) {
    const TemporaryFolder folder;
    folder.write("a.mtl", "newmtl red\nKd 1 0 0\nnewmtl blue  \r\n  Kd 0 0 0.5\n");
    const Coloured result = read_coloured(
        folder, "mtllib a.mtl\n" + kTriangle +
                    "usemtl red\nf 1 2 3\nf 1 2 3\nusemtl  blue \nf 1 2 3\nusemtl red\nf 3 2 1\n");
    EXPECT_EQ(result.albedo, (std::vector<Albedo>{kClay, 0x0000FF, 0x0000FF, 0x800000, 0x0000FF}));
    EXPECT_TRUE(result.warnings.empty());
}
TEST(ObjMaterials, AllLibrariesOfALineAreRead) {
    const TemporaryFolder folder;
    folder.write("a.mtl", "newmtl a\nKd 1 0 0\n");
    folder.write("b c.mtl", "newmtl b\nKd 0 1 0\n");
    const Coloured result = read_coloured(folder, "mtllib none.mtl a.mtl b\\ c.mtl \n" + kVertices +
                                                      "usemtl a\nf 1 2 3\nusemtl b\nf 1 2 3\n");
    EXPECT_EQ(result.albedo, (std::vector<Albedo>{0x0000FF, 0x00FF00}));
    EXPECT_EQ(result.warnings.size(), 1u);
}
TEST(ObjMaterials, MissingLibraryAndMaterialAreWarnings) {
    const TemporaryFolder folder;
    const Coloured result =
        read_coloured(folder, "mtllib none.mtl\n" + kVertices + "usemtl q\nf 1 2 3\n");
    EXPECT_EQ(result.albedo, std::vector<Albedo>{kClay});
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
        std::vector<std::string> warnings;
        MeshFileOptions options;
        options.warn = [&](const Warning& warning) { warnings.push_back(warning.line()); };
        const auto mesh = read_obj(folder.write("scene/a.obj", "mtllib " + name + "\n" + kVertices +
                                                                   "usemtl a\nf 1 2 3\n"),
                                   options);
        EXPECT_EQ(mesh.albedo[0], kClay);
        ASSERT_FALSE(warnings.empty());
        EXPECT_NE(warnings[0].find("not followed"), std::string::npos) << warnings[0];
    }
}
}  // namespace
}  // namespace mray
