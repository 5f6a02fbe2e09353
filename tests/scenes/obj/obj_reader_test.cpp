#include "scenes/obj/obj_reader.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <clocale>
#include <cmath>
#include <locale>
#include <numeric>

#include "tests/support/temporary_folder.h"
#include "tests/support/thrown_error.h"

namespace mray {
namespace {

using namespace test;
namespace fs = std::filesystem;

const std::string kVertices = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
const std::string kTriangle = kVertices + "f 1 2 3\n";

struct Reading {
    FileMesh mesh;
    std::vector<std::string> warnings;
};

Reading read(const std::string& text, MeshFileOptions options = {}) {
    const TemporaryFolder folder;
    Reading reading;
    options.warn = [&](const Warning& warning) { reading.warnings.push_back(warning.line()); };
    reading.mesh = read_obj(folder.write("a.obj", text), options);
    return reading;
}

MeshFileOptions lenient() {
    MeshFileOptions options;
    options.lenient = true;
    return options;
}

// The message without the folder: "a.obj:4: ...".
std::string refusal(const std::string& text, const MeshFileOptions& options = {}) {
    const auto error = error_of([&] { read(text, options); });
    if (!error) return "";
    EXPECT_EQ(error->kind(), ErrorKind::kBadInput) << error->what();
    const std::string message = error->what();
    EXPECT_EQ(message.find('\n'), std::string::npos);
    EXPECT_NE(message.find("; "), std::string::npos) << "does not say what to do: " << message;
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
        const Reading reading = read(text);
        EXPECT_EQ(reading.mesh.positions, (std::vector<vec3>{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}));
        EXPECT_EQ(reading.mesh.faces.corners, (std::vector<std::uint32_t>{0, 1, 2}));
        EXPECT_EQ(reading.mesh.faces.corner_counts, std::vector<std::uint32_t>{3});
        EXPECT_TRUE(reading.warnings.empty());
    }
}

std::string noise() {
    std::string bytes;
    std::uint32_t state = 1;
    for (int i = 0; i < 4096; ++i) {
        state = state * 1664525u + 1013904223u;
        bytes += static_cast<char>(state >> 24);
    }
    return bytes;
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
        {noise(), "a.obj"},
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
    for (const char* face : {"f 0 1 2",
                             "f 1 2 4",
                             "f 1 2 2147483647",
                             "f 1 2 2147483648",
                             "f 1 2 -2147483648",
                             "f 1 2 4294967299",
                             "f 1 2 99999999999999999999",
                             "f 1 2 18446744073709551619",
                             "f -4 -2 -1",
                             "f -1 -2 -9223372036854775809",
                             "f /1 /2 /3",
                             "f 1/// 2/// 3///",
                             "f 1//1/ 2 3",
                             "f / / /",
                             "f a b c",
                             "f 1 2.5 3",
                             "f 1 2 3x",
                             "f 1 2 ++3",
                             "f 1 2 +",
                             "f 1 2 +-3",
                             "f 1/+ 2 3",
                             "f 1/a 2 3",
                             "f 1/1/b 2 3",
                             "f 1/2/3/4 2 3",
                             "f 1,2,3",
                             "f 1 2 3 \\",
                             "f 1 2",
                             "f 1 2 ",
                             "f 1",
                             "f "})
        files.push_back({kVertices + face, "a.obj:4: "});
    for (const char* line_end : {"\n", "\r\n", "\r"})
        files.push_back({with_line_ends(kVertices + "\nf 1 2 9\n", line_end), "a.obj:5: "});
    return files;
}

TEST(ObjReader, RefusesBadFilesWithTheirPlace) {
    for (const BadFile& file : bad_files()) {
        const std::string message = refusal(file.text);
        EXPECT_NE(message.find(file.message), std::string::npos)
            << file.text.substr(0, 100) << ": " << message;
    }
    EXPECT_EQ(refusal("v 0 0 0\nv 0 0 1e30\nv 0 1 0\nf 1 2 3\n"), "");
    EXPECT_EQ(refusal("", lenient()).substr(0, 19), "a.obj: no vertices;");
    EXPECT_EQ(refusal(kVertices, lenient()).substr(0, 16), "a.obj: no faces;");
}

TEST(ObjReader, LenientlyKeepsCoordinatesThatAreNotFinite) {
    const Reading reading =
        read("v nan 0 1e38\nv inf -inf 0\nv 0 1 -1e999\nf 1 2 3\nf 3 2 1\n", lenient());
    const std::vector<vec3>& p = reading.mesh.positions;
    ASSERT_EQ(p.size(), 3u);
    EXPECT_TRUE(std::isnan(p[0].x));
    EXPECT_EQ(p[0].z, 1e38f);
    EXPECT_EQ(p[1].x, INFINITY);
    EXPECT_EQ(p[1].y, -INFINITY);
    EXPECT_EQ(p[2].z, -INFINITY);
    EXPECT_EQ(reading.mesh.faces.corners, (std::vector<std::uint32_t>{0, 1, 2, 2, 1, 0}));
    ASSERT_EQ(reading.warnings.size(), 1u);
    EXPECT_NE(reading.warnings[0].find("a.obj:1: warning: "), std::string::npos);
    EXPECT_NE(reading.warnings[0].find("(and 4 more)"), std::string::npos);
}

TEST(ObjReader, LenientlyLeavesOutFacesThatCannotBeRead) {
    const Reading reading = read(kVertices +
                                     "f 1 2 3\nf 0 1 2\nf a b c\nf 1 2 4\nf 1\nf\nf -4 1 2\n"
                                     "f 1 2 99999999999999999999\nf 3 2 1\nf 1 2",
                                 lenient());
    EXPECT_EQ(reading.mesh.faces.corners, (std::vector<std::uint32_t>{0, 1, 2, 2, 1, 0}));
    EXPECT_EQ(reading.mesh.albedo.size(), 2u);
    ASSERT_EQ(reading.warnings.size(), 1u);
    EXPECT_NE(reading.warnings[0].find("a.obj:5: warning: "), std::string::npos);
    EXPECT_NE(reading.warnings[0].find("left out (and 7 more)"), std::string::npos);
    // Those of vertices that follow, too.
    EXPECT_EQ(read("f 1 2 3\n" + kTriangle, lenient()).mesh.faces.corner_counts.size(), 1u);
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
    const Reading reading = read(kVertices + "f 1 2\nf 1 2 3\nf 2 3\n");
    EXPECT_EQ(reading.mesh.faces.corner_counts.size(), 1u);
    ASSERT_EQ(reading.warnings.size(), 1u);
    EXPECT_NE(
        reading.warnings[0].find("a.obj:4: warning: face of 2 corners; left out (and 1 more)"),
        std::string::npos);
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
        EXPECT_NE(message.find("b.obj:2004: vertex 5000 of 3"), std::string::npos) << message;
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

}  // namespace
}  // namespace mray
