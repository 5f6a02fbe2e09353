#include "scenes/obj/obj_reader.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <clocale>
#include <cmath>
#include <locale>
#include <numeric>

#include "tests/scenes/opened_scene.h"

namespace mray {
namespace {

using namespace test;
namespace fs = std::filesystem;

const std::string kVertices = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
const std::string kTriangle = kVertices + "f 1 2 3\n";

ReadMesh read(const std::string& text, const MeshFileOptions& options = {}) {
    return read_mesh(read_obj, TemporaryFolder().write("a.obj", text), options);
}

// The message without the folder: "a.obj:4: ...".
std::string refusal(const std::string& text, const MeshFileOptions& options = {}) {
    const auto error = error_of([&] { read(text, options); });
    if (!error) return "";
    EXPECT_EQ(error->kind(), ErrorKind::kBadInput) << error->what();
    const std::string message = error->what();
    EXPECT_FALSE(has(message, "\n"));
    EXPECT_TRUE(has(message, "; "));
    return message.substr(message.find("a.obj"));
}

std::string with_line_ends(const std::string& text, const std::string& line_end) {
    std::string result;
    for (const char c : text) result += c == '\n' ? line_end : std::string{c};
    return result;
}

TEST(ObjReader, ReadsATriangleHoweverItIsWritten) {
    for (const std::string& text :
         {kTriangle, "\xEF\xBB\xBF" + kTriangle, with_line_ends(kTriangle, "\r\n"),
          with_line_ends(kTriangle, "\r"), kVertices + "f 1 2 3", "f 1 2 3\n" + kVertices,
          std::string("v 0 0 0 1\nv 1 0 0\nv 0 1 0 .2 .3 .4\nf 1 2 3\n"), kVertices + "f 1/ 2/ 3/",
          kVertices + "f 1// 2// 3//", kVertices + "f +1 +2 +3", kVertices + "f 1/1/ 2/ 3//1",
          kVertices + "f +1/+1/+1 2/-1 +3//-1", kVertices + "f 1 \\\n 2 3\n",
          kVertices + "f 1 \\\r\n 2\\\r\n3\r\n",
          std::string("v 0 0\\\n0\nv 1 0 0\nv 0 1 0\nf\\\n1 2 3\n"),
          "# a path such as C:\\\n" + kTriangle, fmt::format("#{:200000}\n", "x") + kTriangle,
          "o x\ng y\ns off\np 1\nl 1 2\ncurv 0 1 1 2\nvt 0\nvn a b\nfoo bar\n" + kTriangle}) {
        SCOPED_TRACE(text.substr(0, 100));
        const ReadMesh reading = read(text);
        EXPECT_EQ(reading.mesh.positions, (std::vector<vec3>{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}));
        EXPECT_EQ(reading.mesh.faces.corners, (std::vector<std::uint32_t>{0, 1, 2}));
        EXPECT_EQ(reading.mesh.faces.corner_counts, std::vector<std::uint32_t>{3});
        EXPECT_TRUE(reading.warnings.empty());
    }
}

/// In either order of bytes, with its mark or without.
std::string utf16(bool little, bool has_mark) {
    std::string text = !has_mark ? "" : little ? "\xFF\xFE" : "\xFE\xFF";
    for (const char c : kTriangle) text += little ? std::string{c, '\0'} : std::string{'\0', c};
    return text;
}

struct BadFile {
    std::string text;
    /// A part of the message.
    const char* message;
};

std::vector<BadFile> bad_files() {
    std::vector<BadFile> files = {
        {"", "a.obj: no vertices;"},
        {kVertices, "a.obj: no faces;"},
        {std::string("\x89PNG\r\n\x1A\n\0\0\0\rIHDR", 16), "a.obj"},
        {std::string(4096, '\x82'), "a.obj"},
        {utf16(true, true), "UTF-16"},
        {utf16(true, false), "UTF-16"},
        {utf16(false, true), "UTF-16"},
        {utf16(false, false), "UTF-16"},
        {kTriangle + std::string("\0\0\0v 5 5 5\n", 11), "a.obj:5: "},
        {kTriangle + std::string("# \0\n", 4), "a.obj:5: "},
        {"o \x01\n" + kTriangle, "a.obj:1: "},
        {"v 0,5 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "comma"},
        {"v 0 0 0\nv 0 0 1e38\nv 0 1 0\nf 1 2 3\n", "a.obj:2: "},
        {"v 0 0 0\nv 0 0 -1.1e30\nv 0 1 0\nf 1 2 3\n", "a.obj:2: "},
        {kTriangle + "f 1 2", "a.obj:5: "},
        {kVertices + "f 1 \\\n 2 \\\n 3\nf 0 1 2\n", "a.obj:7: "},
    };
    for (const char* x : {"nan", "-nan", "NaN", "inf", "-inf", "Infinity", "1e400", "-1e999"})
        files.push_back({fmt::format("v 0 0 0\nv {} 0 0\nv 0 1 0\nf 1 2 3\n", x), "a.obj:2: "});
    for (const char* vertex : {"v\n", "v \n", "v 1\n", "v 1 2\n", "v 1 2 # 3\n"})
        files.push_back({vertex + kTriangle, "a.obj:1: "});
    for (const char* corner : {"0",
                               "4",
                               "2147483647",
                               "2147483648",
                               "-2147483648",
                               "4294967299",
                               "99999999999999999999",
                               "18446744073709551619",
                               "-4",
                               "-9223372036854775809",
                               "/1",
                               "1///",
                               "1//1/",
                               "/",
                               "a",
                               "2.5",
                               "3x",
                               "++3",
                               "+",
                               "+-3",
                               "1/+",
                               "1/a",
                               "1/1/b",
                               "1/2/3/4",
                               "1,2,3",
                               "3 \\"})
        files.push_back({kVertices + "f 1 2 " + corner, "a.obj:4: "});
    for (const char* face : {"f 1 2", "f 1 2 ", "f 1", "f "})
        files.push_back({kVertices + face, "a.obj:4: "});
    for (const char* line_end : {"\n", "\r\n", "\r"})
        files.push_back({with_line_ends(kVertices + "\nf 1 2 9\n", line_end), "a.obj:5: "});
    return files;
}

TEST(ObjReader, RefusesBadFilesWithTheirPlace) {
    for (const BadFile& file : bad_files()) {
        const std::string message = refusal(file.text);
        EXPECT_TRUE(has(message, file.message)) << file.text.substr(0, 100);
    }
    EXPECT_EQ(refusal("v 0 0 0\nv 0 0 1e30\nv 0 1 0\nf 1 2 3\n"), "");
    EXPECT_EQ(refusal("", {.lenient = true}).substr(0, 19), "a.obj: no vertices;");
    EXPECT_EQ(refusal(kVertices, {.lenient = true}).substr(0, 16), "a.obj: no faces;");
}

TEST(ObjReader, LenientlyKeepsCoordinatesThatAreNotFinite) {
    const ReadMesh reading =
        read("v nan 0 1e38\nv inf -inf 0\nv 0 1 -1e999\nf 1 2 3\nf 3 2 1\n", {.lenient = true});
    const std::vector<vec3>& p = reading.mesh.positions;
    ASSERT_EQ(p.size(), 3u);
    EXPECT_TRUE(std::isnan(p[0].x));
    EXPECT_EQ(p[0].z, 1e38f);
    EXPECT_EQ(p[1].x, INFINITY);
    EXPECT_EQ(p[1].y, -INFINITY);
    EXPECT_EQ(p[2].z, -INFINITY);
    EXPECT_EQ(reading.mesh.faces.corners, (std::vector<std::uint32_t>{0, 1, 2, 2, 1, 0}));
    ASSERT_EQ(reading.warnings.size(), 1u);
    EXPECT_TRUE(has(reading.warnings[0], "a.obj:1: warning: "));
    EXPECT_TRUE(has(reading.warnings[0], "(and 4 more)"));
}

TEST(ObjReader, LenientlyLeavesOutFacesThatCannotBeRead) {
    const ReadMesh reading = read(kVertices +
                                      "f 1 2 3\nf 0 1 2\nf a b c\nf 1 2 4\nf 1\nf\nf -4 1 2\n"
                                      "f 1 2 99999999999999999999\nf 3 2 1\nf 1 2",
                                  {.lenient = true});
    EXPECT_EQ(reading.mesh.faces.corners, (std::vector<std::uint32_t>{0, 1, 2, 2, 1, 0}));
    EXPECT_EQ(reading.mesh.albedo.size(), 2u);
    ASSERT_EQ(reading.warnings.size(), 1u);
    EXPECT_TRUE(has(reading.warnings[0], "a.obj:5: warning: "));
    EXPECT_TRUE(has(reading.warnings[0], "left out (and 7 more)"));
    // Those of vertices that follow, too.
    EXPECT_EQ(read("f 1 2 3\n" + kTriangle, {.lenient = true}).mesh.faces.corner_counts.size(), 1u);
}

TEST(ObjReader, ReadsTheCornersOfFaces) {
    const auto corners = [](const std::string& text) { return read(text).mesh.faces.corners; };
    EXPECT_EQ(corners(kVertices + "f -3 -2 -1\n" + kVertices + "f -3 -2 -1\n"),
              (std::vector<std::uint32_t>{0, 1, 2, 3, 4, 5}));
    EXPECT_EQ(corners(kVertices + "vt 0 0\nvn 0 0 1\nf 1/1/1 2/1/1 3/1/1\nf 1//1 2//1 3//1\n"
                                  "f 1/1 2/1 3/1\nf 1/-1/-1 2/-1/-1 3/99/999999999\n"),
              (std::vector<std::uint32_t>{0, 1, 2, 0, 1, 2, 0, 1, 2, 0, 1, 2}));
    std::string text;
    for (int i = 0; i < 300; ++i) text += fmt::format("v {} 0 0\n", i);
    text += "f";
    for (int i = 1; i <= 300; ++i) text += fmt::format(" {}", i);
    std::vector<std::uint32_t> polygon(300);
    std::iota(polygon.begin(), polygon.end(), 0u);
    polygon.insert(polygon.end(), {0, 1, 2, 3});
    EXPECT_EQ(corners(text + "\nf 1 2 3 4\n"), polygon);
}

TEST(ObjReader, FaceOfTwoCornersIsLeftOutWithAWarning) {
    const ReadMesh reading = read(kVertices + "f 1 2\nf 1 2 3\nf 2 3\n");
    EXPECT_EQ(reading.mesh.faces.corner_counts.size(), 1u);
    ASSERT_EQ(reading.warnings.size(), 1u);
    EXPECT_TRUE(
        has(reading.warnings[0], "a.obj:4: warning: face of 2 corners; left out (and 1 more)"));
}

class CommaPunctuation : public std::numpunct<char> {
    char do_decimal_point() const override { return ','; }
    char do_thousands_sep() const override { return '.'; }
    std::string do_grouping() const override { return "\3"; }
};
TEST(ObjReader, DecimalsDoNotDependOnTheLocale) {
    const std::string c_locale = std::setlocale(LC_ALL, nullptr);
    const std::locale before =
        std::locale::global(std::locale(std::locale(), new CommaPunctuation));
    for (const char* name : {"de_DE.UTF-8", "tr_TR.UTF-8"}) {
        std::setlocale(LC_ALL, name);  // has no effect if the locale is not installed
        const TemporaryFolder folder;
        folder.write("a.mtl", "newmtl m\nKd 0.5 0.25 1.0\n");
        const auto mesh = read_obj(folder.write(
            "a.obj", "mtllib a.mtl\nusemtl m\nv 0.5 0 0\nv 1.5 0 0\nv 0 1.5 0\nf 1 2 3\n"));
        EXPECT_EQ(mesh.positions[0].x, 0.5f);
        EXPECT_EQ(mesh.positions[1].x, 1.5f);
        EXPECT_EQ(mesh.albedo[0], 0xFF4080u);
        const fs::path broken =
            folder.write("b.obj", kVertices + std::string(2000, '\n') + "f 1 2 5000\n");
        const std::string message = message_of([&] { read_obj(broken); });
        EXPECT_TRUE(has(message, "b.obj:2004: vertex 5000 of 3"));
    }
    std::locale::global(before);
    std::setlocale(LC_ALL, c_locale.c_str());
}

TEST(MeshRules, MoreTrianglesThanTheLimitAreRefused) {
    MeshRules rules(false, [] { return std::string("a.obj:1"); });
    rules.count_triangles(kMaxTriangles - 1);
    rules.count_triangles(1);
    EXPECT_EQ(kind_of([&] { rules.count_triangles(1); }), ErrorKind::kLimit);
    EXPECT_EQ(kMaxTriangles, std::uint64_t{1} << 28);
}

TEST(ObjNormals, NumberCornersThatShareOne) {
    // Two triangles over the edge 2 3: the corners at 2 share a normal that is written twice, those
    // at 3 have different ones.
    const FileMesh mesh = read(kVertices +
                               "v 1 1 0\nvn 0 0 1\nvn 0 0 1.0\nvn 0 -0 1\nvn 1 0 0\n"
                               "f 1//1 2//1 3//1\nf 2//2 4//3 3//-1\n")
                              .mesh;
    EXPECT_EQ(mesh.smooth, (std::vector<std::uint32_t>{0, 1, 2, 1, 4, 5}));
}

TEST(ObjNormals, CornersWithoutOneHaveNumbersOfTheirOwn) {
    const FileMesh mesh =
        read(kVertices + "vn 0 0 1\nf 1//1 2 3\nf 1//1 2 3//7\nf 1//-2 2 3//1\n").mesh;
    EXPECT_EQ(mesh.smooth, (std::vector<std::uint32_t>{0, 1, 2, 0, 4, 5, 6, 7, 8}));
}

TEST(ObjNormals, AreLeftOutUnlessAskedForAndThere) {
    const std::string text = kVertices + "vn 0 0 1\nf 1//1 2//1 3//1\n";
    EXPECT_TRUE(read(text, {.positions_only = true}).mesh.smooth.empty());
    EXPECT_TRUE(read(kVertices + "vn 0 0 1\nf 1 2 3\n").mesh.smooth.empty());
}

MaterialMap read_mtl(const std::string& text) {
    WarningCount unread;
    return read_mtl_text(text, "a.mtl", unread);
}
std::string warning_of(const std::string& text) {
    WarningCount unread;
    read_mtl_text(text, "a.mtl", unread);
    std::string line;
    unread.tell([&](const Warning& warning) { line = warning.line(); });
    return line;
}
Material material_of(const std::string& statement) {
    return read_mtl("newmtl a\n" + statement + "\nnewmtl b\nKd 1 1 1\n").at("a");
}

TEST(MtlReader, ReadsLinearColoursOfEightBitsOrGreys) {
    const auto materials = read_mtl("newmtl a\nKa 1 1 1\nKd 0 0.5 1\nmap_Kd x.png\n");
    ASSERT_EQ(materials.size(), 1u);
    EXPECT_EQ(materials.at("a").albedo, 0xFF8000u);
    EXPECT_FALSE(read_mtl("Kd 1 0 0\nnewmtl a\nNs 5\n").at("a").albedo);
    EXPECT_EQ(material_of("Kd 0 0 0").albedo, 0u);
    EXPECT_EQ(material_of("Kd 1").albedo, 0xFFFFFFu);
    EXPECT_EQ(material_of("Kd 0.5 # half").albedo, 0x808080u);
    EXPECT_EQ(warning_of("newmtl a\nKd 1\n"), "");
}
TEST(MtlReader, ColoursThatAreNotReadAreWarnings) {
    for (const char* kd : {"Kd a 0 1", "Kd 1 x", "Kd 1 0", "Kd spectral x.rfl 1", "Kd xyz 0 1 0"}) {
        EXPECT_FALSE(material_of(kd).albedo) << kd;
        EXPECT_EQ(warning_of(fmt::format("newmtl a\n{}\n", kd)),
                  fmt::format("a.mtl:2: warning: '{}' is not read; write one number or three", kd));
    }
    EXPECT_EQ(material_of("Kd nan 0 2").albedo, 0xFF0000u);
    EXPECT_EQ(warning_of("newmtl a\nKd nan 0 2\n"),
              "a.mtl:2: warning: colour nan is not from 0 to 1; clamped (and 1 more)");
}
TEST(MtlReader, TheFirstMaterialOfANameStays) {
    const auto materials = read_mtl("newmtl a\nKd 1 0 0\nnewmtl a\nKd 0 1 0\n");
    EXPECT_EQ(materials.at("a").albedo, 0x0000FFu);
}
TEST(MtlReader, NamesOfTexturesMayHaveBlanksQuotesAndBackslashes) {
    for (const auto& [statement, map] : {std::pair("map_Kd -clamp on x y.png", "x y.png"),
                                         {"map_Kd", ""},
                                         {"map_Kd   a b.png\t", "a b.png"},
                                         {"map_Kd \"a b.png\"", "a b.png"},
                                         {"map_Kd C:\\x\\a.png", "C:/x/a.png"}}) {
        EXPECT_EQ(material_of(statement).map, map);
        EXPECT_FALSE(material_of(statement).albedo);
    }
    EXPECT_EQ(material_of("map_Kd a.png").library, "a.mtl");
}
TEST(MtlReader, ScalesOffsetsAndClampsOfTexturesAreReadAndOtherOptionsPassed) {
    const Material a = material_of("map_Kd -s 2 3 1 -mm 0 1 -o 0.5 0 0 -clamp on a b.png");
    EXPECT_EQ(a.map, "a b.png");
    EXPECT_EQ(a.scale, (std::array<float, 2>{2, 3}));
    EXPECT_EQ(a.offset, (std::array<float, 2>{0.5f, 0}));
    EXPECT_TRUE(a.clamp);
    EXPECT_FALSE(material_of("map_Kd -clamp off a.png").clamp);
}
TEST(MtlReader, NamesMayHaveBlanksAndMustNotBeEmpty) {
    const MaterialMap materials = read_mtl("newmtl  a  b \nKd 1\nnewmtl\nKd 0\nmap_Kd x.png\n");
    ASSERT_EQ(materials.size(), 1u);
    EXPECT_EQ(materials.at("a  b").albedo, 0xFFFFFFu);
    EXPECT_EQ(materials.at("a  b").map, "");
}
TEST(MtlReader, TexturesThatAreNotReadAreWarnings) {
    for (const char* words : {"", "-s 2 2 a.png", "-o 1e39 0 0 a.png"}) {
        const std::string statement = fmt::format("map_Kd {}", words);
        EXPECT_EQ(material_of(statement).map, "");
        EXPECT_EQ(warning_of("newmtl a\n" + statement + "\n"),
                  fmt::format("a.mtl:2: warning: map_Kd '{}' is not read; write -s and -o with "
                              "three numbers, and the name of a file",
                              words));
    }
}

const std::string kSquare = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n";
const std::string kFace = "f 1/1 2/2 3/3 4/4\n";
constexpr Albedo kWhite = 0xFFFFFF;

ReadMesh read_in(const TemporaryFolder& folder, const std::string& text,
                 const std::string& name = "a.obj") {
    return read_mesh(read_obj, folder.write(name, text));
}

TEST(ObjMaterials, DiffuseColourBecomesTheAlbedoOfTheFacesAfterIt) {
    const TemporaryFolder folder;
    folder.write("a.mtl", "newmtl red\nKd 1 0 0\nnewmtl blue  \r\n  Kd 0 0 0.5\n");
    const ReadMesh result = read_in(
        folder, "mtllib a.mtl\n" + kTriangle +
                    "usemtl red\nf 1 2 3\nf 1 2 3\nusemtl  blue \nf 1 2 3\nusemtl red\nf 3 2 1\n");
    EXPECT_EQ(result.mesh.albedo,
              (std::vector<Albedo>{kClay, 0x0000FF, 0x0000FF, 0x800000, 0x0000FF}));
    EXPECT_TRUE(result.warnings.empty());
}
TEST(ObjMaterials, AllLibrariesAreRead) {
    const TemporaryFolder folder;
    folder.write("a.mtl", "newmtl a\nKd 1 0 0\n");
    folder.write("b c.mtl", "newmtl b\nKd 0 1 0\n");
    const ReadMesh result =
        read_in(folder, "mtllib none.mtl\nmtllib a.mtl\nmtllib b c.mtl\n" + kVertices +
                            "usemtl a\nf 1 2 3\nusemtl b\nf 1 2 3\n");
    EXPECT_EQ(result.mesh.albedo, (std::vector<Albedo>{0x0000FF, 0x00FF00}));
    EXPECT_EQ(result.warnings.size(), 1u);
}
TEST(ObjMaterials, MissingLibraryAndMaterialAreWarnings) {
    const TemporaryFolder folder;
    const ReadMesh result =
        read_in(folder, "mtllib none.mtl\n" + kVertices + "usemtl q\nf 1 2 3\n");
    EXPECT_EQ(result.mesh.albedo, std::vector<Albedo>{kClay});
    ASSERT_EQ(result.warnings.size(), 2u);
    EXPECT_TRUE(has(result.warnings[0], "a.obj: warning: "));
    EXPECT_TRUE(has(result.warnings[0], "none.mtl: no such file"));
    EXPECT_TRUE(has(result.warnings[1], "'q'"));
}
TEST(ObjMaterials, LibraryOutsideOfTheFolderIsNotOpened) {
    const TemporaryFolder folder;
    folder.write("outside.mtl", "newmtl a\nKd 1 0 0\n");
    const TemporaryFolder other;
    const fs::path absolute = other.write("abs.mtl", "newmtl a\nKd 1 0 0\n");
    for (const std::string& name :
         {std::string("../outside.mtl"), std::string("../../../etc/passwd"), absolute.native()}) {
        const ReadMesh result = read_in(
            folder, "mtllib " + name + "\n" + kVertices + "usemtl a\nf 1 2 3\n", "scene/a.obj");
        EXPECT_EQ(result.mesh.albedo[0], kClay);
        ASSERT_FALSE(result.warnings.empty());
        EXPECT_TRUE(has(result.warnings[0], "not followed"));
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
    const ReadMesh result = read_in(
        folder, "mtllib a.mtl\n" + kSquare + kFace + "usemtl m\n" + kFace +
                    "usemtl n\nf -4/-1 -3/-2 -2/-3\nusemtl p\n" + kFace + "usemtl m\n" + kFace);
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
    const ReadMesh result = read_in(
        folder, "mtllib a.mtl\n" + kSquare + "usemtl m\n" + kFace + kFace + "usemtl n\n" + kFace);
    EXPECT_TRUE(result.mesh.textures.empty());
    EXPECT_EQ(result.mesh.albedo, (std::vector<Albedo>{0xFF0000, 0xFF0000, kClay}));
    ASSERT_EQ(result.warnings.size(), 1u);
    EXPECT_TRUE(has(result.warnings[0], "a.mtl: warning: map_Kd: "));
    EXPECT_TRUE(has(result.warnings[0], "none.png: no such file"));
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
    EXPECT_TRUE(has(warnings[0], "not followed"));
    EXPECT_TRUE(has(warnings[0], "(and 1 more)"));
}

TEST(ObjTextures, FacesWithoutCoordinatesHaveTheirColourAlone) {
    const Folder folder("Kd 1 0 0\nmap_Kd a.png\n");
    const ReadMesh result = read_in(folder, "mtllib a.mtl\nusemtl m\n" + kSquare + "f 1/1 2/2 3\n" +
                                                "f 1//1 2//1 3//1\nf 1/9 2/9 3/9\n" + kFace);
    EXPECT_EQ(result.mesh.face_textures,
              (std::vector<std::uint32_t>{kNoTexture, kNoTexture, kNoTexture, 0}));
    ASSERT_EQ(result.warnings.size(), 1u);
    EXPECT_TRUE(has(result.warnings[0], "without texture coordinates"));
    EXPECT_TRUE(has(result.warnings[0], "(and 2 more)"));
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
