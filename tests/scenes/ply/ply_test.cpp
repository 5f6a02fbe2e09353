#include "scenes/ply/ply_reader.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <limits>
#include <utility>

#include "tests/scenes/opened_scene.h"
#include "tests/scenes/ply/ply_files.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/thrown_error.h"

namespace mray {
namespace {

using namespace std::string_literals;
using namespace test;

const std::vector<std::vector<double>> kCorners = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
const PlyItems kSquare = ply_vertices(kCorners);
const PlyItems kTwoFaces = ply_faces({{3, 0, 1, 2}, {4, 0, 1, 2, 3}});
const std::vector<std::uint32_t> kTwoFacesCorners = {0, 1, 2, 0, 1, 2, 3};

ReadMesh read(const std::string& bytes, const MeshFileOptions& options = {}) {
    return read_mesh(read_ply, TemporaryFolder().write("a.ply", bytes), options);
}

std::unique_ptr<Animation> open(const std::string& bytes, const char* name = "a.ply") {
    const TemporaryFolder folder;
    return open_scene(folder.write(name, bytes).native());
}

void expect_the_square(const std::string& bytes) {
    const ReadMesh reading = read(bytes);
    EXPECT_TRUE(reading.warnings.empty()) << reading.warnings[0];
    EXPECT_EQ(reading.mesh.positions,
              (std::vector<vec3>{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}}));
    EXPECT_EQ(reading.mesh.faces.corners, kTwoFacesCorners);
    EXPECT_EQ(reading.mesh.faces.corner_counts, (std::vector<std::uint32_t>{3, 4}));
}

TEST(PlyReader, ReadsEveryTypeOfCoordinatesInEveryEncoding) {
    for (const PlyEncoding encoding : kPlyEncodings) {
        for (const char* type :
             {"char", "uchar", "short", "ushort", "int", "uint", "float", "double", "int8", "uint8",
              "int16", "uint16", "int32", "uint32", "float32", "float64"}) {
            SCOPED_TRACE(ply_format(encoding) + " " + type);
            expect_the_square(ply(encoding, {ply_vertices(kCorners, type), kTwoFaces}));
        }
    }
}

TEST(PlyReader, ReadsEveryTypeOfListsInEveryEncoding) {
    for (const PlyEncoding encoding : kPlyEncodings) {
        for (const char* count : {"char", "uchar", "short", "ushort", "int", "uint"}) {
            for (const char* index : {"char", "uchar", "short", "ushort", "int", "uint"}) {
                SCOPED_TRACE(fmt::format("{} {} {}", ply_format(encoding), count, index));
                const std::string types = fmt::format("{} {}", count, index);
                expect_the_square(ply(encoding, {kSquare, ply_faces(kTwoFaces.items, types)}));
            }
        }
    }
}

TEST(PlyReader, SkipsElementsAndPropertiesThatItDoesNotKnow) {
    const PlyItems camera = {
        "camera", {"float view_px", "uchar a", "double b"}, {{1, 2, 3}, {4, 5, 6}}};
    const PlyItems edges = {"edge",
                            {"int v1", "list uchar float f", "short v2"},
                            {{1, 3, 0.5, 1.5, 2.5, 7}, {1, 0, 9}}};
    const PlyItems nothing = {"nothing", {}, {}};
    PlyItems vertices = {"vertex", {"uchar flag", "float x", "double q", "float z", "float y"}, {}};
    for (const auto& p : kCorners) vertices.items.push_back({7, p[0], 0.25, p[2], p[1]});
    PlyItems listed = {"vertex", {"float x", "list uchar short l", "float y", "float z"}, {}};
    for (const auto& p : kCorners) listed.items.push_back({p[0], 2, 1, 1, p[1], p[2]});
    const PlyItems faces = {"face",
                            {"uchar flags", "list uchar uint vertex_index", "list int double uv"},
                            {{1, 3, 0, 1, 2, 1, 0.5}, {2, 4, 0, 1, 2, 3, 0}}};
    for (const PlyEncoding encoding : kPlyEncodings) {
        SCOPED_TRACE(ply_format(encoding));
        expect_the_square(ply(encoding, {camera, vertices, edges, kTwoFaces, nothing}));
        expect_the_square(ply(encoding, {edges, faces, camera, kSquare}));
        expect_the_square(ply(encoding, {listed, faces, edges}));
    }
}

TEST(PlyReader, TextIsRoundedCorrectlyWhateverItsType) {
    // The double between two floats that is closest to the middle would be rounded twice.
    for (const char* type : {"float", "double"}) {
        const std::string text = fmt::format(
            "ply\nformat ascii 1.0\nelement vertex 3\nproperty {0} x\nproperty {0} y\n"
            "property {0} z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n"
            "0.1 1e-42 1.000000059604644775390626\n+1 -0 .5\n1E2 3. 4\n3 0 1 2\n",
            type);
        const ReadMesh reading = read(text);
        EXPECT_EQ(reading.mesh.positions[0].x, 0.1f);
        EXPECT_EQ(std::bit_cast<unsigned>(reading.mesh.positions[0].y), 714u);
        EXPECT_EQ(reading.mesh.positions[0].z, std::nextafter(1.0f, 2.0f));
        EXPECT_EQ(std::bit_cast<unsigned>(reading.mesh.positions[1].y), 0x80000000u);
        EXPECT_EQ(reading.mesh.positions[2], vec3(100, 3, 4));
    }
}

TEST(PlyReader, PolygonsBecomeTheTrianglesOfTheirObjFile) {
    // Concave, and not flat.
    const std::vector<std::vector<double>> positions = {{0, 0, 0},   {4, 0, 0.5}, {4, 4, 0},
                                                        {2, 1, 0},   {0, 4, 0},   {-1, 2, 1},
                                                        {0.5, 2, 0}, {7, 7, 7}};
    const std::vector<std::vector<double>> faces = {
        {7, 0, 1, 2, 3, 4, 5, 6}, {5, 0, 1, 3, 2, 7}, {3, 4, 4, 4}};
    std::string obj;
    for (const auto& p : positions) obj += fmt::format("v {} {} {}\n", p[0], p[1], p[2]);
    for (const auto& face : faces) {
        obj += "f";
        for (std::size_t i = 1; i < face.size(); ++i) obj += fmt::format(" {}", face[i] + 1);
        obj += "\n";
    }
    const auto expected = open(obj, "a.obj");
    for (const PlyEncoding encoding : kPlyEncodings) {
        const auto actual = open(ply(encoding, {ply_vertices(positions), ply_faces(faces)}));
        EXPECT_EQ(actual->topology().triangles, expected->topology().triangles);
        EXPECT_EQ(actual->topology().albedo, expected->topology().albedo);
        EXPECT_EQ(topology_hash(actual->topology()), topology_hash(expected->topology()));
        EXPECT_EQ(actual->smooth_corners().data(), actual->topology().triangles.data());
    }
}

TEST(PlyReader, TrianglesHaveTheMeanOfTheColoursOfTheirVertices) {
    for (const PlyEncoding encoding : kPlyEncodings) {
        PlyItems vertices = {
            "vertex",
            {"float x", "float y", "float z", "uchar red", "uchar green", "uchar blue",
             "uchar alpha"},
            {{0, 0, 0, 255, 0, 128, 9}, {1, 0, 0, 255, 0, 128, 9}, {0, 1, 0, 0, 255, 128, 9}}};
        const PlyItems faces = ply_faces({{3, 0, 1, 2}});
        // Squares are linear: (128 / 255)^2 * 255 is 64.25.
        EXPECT_EQ(open(ply(encoding, {vertices, faces}))->topology().albedo,
                  std::vector<Albedo>{170u | 85u << 8 | 64u << 16});
        for (std::size_t i = 3; i < 6; ++i) {
            vertices.properties[i].replace(0, 5, i == 4 ? "double" : "float");
            for (auto& item : vertices.items) item[i] /= 128;
        }
        // Clamped before the mean.
        EXPECT_EQ(open(ply(encoding, {vertices, faces}))->topology().albedo,
                  std::vector<Albedo>{170u | 85u << 8 | 255u << 16});
        vertices.properties[3] = "float r";
        EXPECT_TRUE(read(ply(encoding, {vertices, faces})).warnings.empty());
        EXPECT_EQ(open(ply(encoding, {vertices, faces}))->topology().albedo,
                  std::vector<Albedo>{kClay});
    }
}

TEST(PlyReader, VerticesOfEqualPositionAndNormalAreSmoothTogether) {
    // Vertices 1 2 stand twice: 4 has the normal of 1 and 5 has another one than 2.
    const PlyItems vertices = {
        "vertex",
        {"float x", "float y", "float z", "float nx", "float ny", "float nz"},
        {{0, 0, 0, 0, 0, 1},
         {1, 0, 0, 0, 0, 1},
         {0, 1, 0, 0, 0, 1},
         {1, 1, 0, 0, 0, 1},
         {1, 0, 0, 0, -0.0, 1},
         {0, 1, 0, 1, 0, 0},
         {9, 9, 9, 1, 0, 0}}};
    for (const PlyEncoding encoding : kPlyEncodings) {
        const auto animation =
            open(ply(encoding, {vertices, ply_faces({{3, 0, 1, 2}, {3, 4, 3, 5}})}));
        const std::span<const uvec3> smooth = animation->smooth_corners();
        ASSERT_EQ(smooth.size(), 2u);
        EXPECT_EQ(smooth[1].x, smooth[0].y);
        EXPECT_NE(smooth[1].z, smooth[0].z);
        EXPECT_NE(smooth[0].x, smooth[0].y);
        for (const uvec3& t : smooth) EXPECT_LT(std::max({t.x, t.y, t.z}), 6u);
    }
}

TEST(PlyReader, LenientReadingAcceptsWhatItAcceptsInObjFiles) {
    const double nan = std::numeric_limits<double>::quiet_NaN();
    for (const PlyEncoding encoding : kPlyEncodings) {
        auto corners = kCorners;
        corners[1][1] = nan;
        corners[2][2] = 1e31;
        const PlyItems faces = ply_faces(
            {{3, 0, 1, 2}, {1, 0}, {3, 0, 1, 7}, {3, 0, -1, 2}, {0}, {2, 0, 1}, {3, 1, 2, 3}});
        const ReadMesh reading =
            read(ply(encoding, {ply_vertices(corners), faces}), {.lenient = true});
        EXPECT_TRUE(std::isnan(reading.mesh.positions[1].y));
        EXPECT_EQ(reading.mesh.positions[2].z, 1e31f);
        EXPECT_EQ(reading.mesh.faces.corners, (std::vector<std::uint32_t>{0, 1, 2, 1, 2, 3}));
        ASSERT_EQ(reading.warnings.size(), 2u);
        EXPECT_TRUE(has(reading.warnings[0], "left out (and 4 more)"));
        EXPECT_TRUE(has(reading.warnings[1], "kept as it is (and 1 more)"));
        EXPECT_EQ(kind_of([&] { read(ply(encoding, {kSquare}), {.lenient = true}); }),
                  ErrorKind::kBadInput);
    }
}

TEST(PlySequence, IsThatOfObjFiles) {
    const TemporaryFolder folder;
    for (int i = 0; i < 3; ++i) {
        auto corners = kCorners;
        corners[0][2] = i;
        folder.write(fmt::format("c/f_{:04}.ply", i + 5),
                     ply(kPlyEncodings[i], {ply_vertices(corners), kTwoFaces}));
    }
    for (const char* name : {"c", "c/f_%04d.ply", "c/f_*.ply"}) {
        const auto animation = open_scene(folder.file(name));
        EXPECT_EQ(animation->last_frame() - animation->first_frame(), 2);
        std::vector<vec3> positions(4);
        animation->positions(animation->first_frame() + 1.5, positions);
        EXPECT_EQ(positions[0], vec3(0, 0, 1.5f));
    }
}

const PlyItems kVertices = ply_vertices({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}});
const PlyItems kFace = ply_faces({{3, 0, 1, 2}});
const std::string kLists = "property list uchar int vertex_indices\n";
const std::string kCoordinates = "property float x\nproperty float y\nproperty float z\n";
const std::string kThree = "element vertex 3\n" + kCoordinates;
const std::string kRows = "0 0 0\n1 0 0\n0 1 0\n";

/// A binary file of three vertices and one face with these bytes.
std::string binary_face(const std::string& types, const std::string& bytes) {
    const PlyItems face = {"face", {"list " + types + " vertex_indices"}, {{}}};
    return ply_header(PlyEncoding::kLittleEndian, {kVertices, face}) +
           ply_body(PlyEncoding::kLittleEndian, {kVertices}) + bytes;
}

/// Bad files, or parts of them, and how the messages begin, after the name of the file.
using BadFiles = std::vector<std::pair<std::string, const char*>>;

const BadFiles kBadFiles = {
    {"", ":1: not a PLY file"},
    {std::string("\x89PNG\r\n\x1A\n\0\0\0\rIHDR", 16), ":1: not a PLY file"},
    {"plyx\nformat ascii 1.0\nend_header\n", ":1: not a PLY file"},
    {"\xEF\xBB\xBFply\n", ":1: not a PLY file"},
    {"ply", ":2: no end_header"},
    {"ply\nelement vertex 3\n" + kCoordinates + "end_header\n" + kRows, ":6: no format"},
    {"ply\nformat binary_middle_endian 1.0\nend_header\n", ":2: format"},
    {"ply\nformat ascii 2.0\nend_header\n", ":2: format"},
    {"ply\nformat ascii\nend_header\n", ":2: format"},
    {"ply\nformat ascii 1.0\n" + kThree + kRows, ":7: unknown statement '0 0 0'"},
    {"ply\nformat ascii 1.0\n" + kThree, ":7: no end_header"},
    {"ply\n" + std::string(std::size_t{2} << 20, 'c'), ":2: unknown statement"},
    {binary_face("uchar int", "\3\0\0\0\0\1\0\0\0\3\0\0\0"s), ": byte 205: vertex 3 of 3"},
    {binary_face("uchar int", "\3\0\0\0\0\1\0\0\0\xff\xff\xff\xff"s), ": byte 205: vertex -1 of 3"},
    {binary_face("uchar uint", "\3\0\0\0\0\1\0\0\0\xff\xff\xff\xff"s),
     ": byte 206: vertex 4294967295 of 3"},
    {binary_face("char int", "\xfd\0\0\0\0\1\0\0\0\2\0\0\0"s), ": byte 204: list of -3 entries"},
    {binary_face("uint uchar", "\xff\xff\xff\xff\0\1\2"s), ": byte 206: ends within 'face' 0 of 1"},
    {binary_face("int int", "\xff\xff\xff\x7f\0\1\2"s), ": byte 203: ends within 'face' 0 of 1"},
    {binary_face("uchar int", "\3"), ": byte 205: ends within 'face' 0 of 1"},
    {ply_header(PlyEncoding::kBigEndian, {kVertices}) + std::string(35, '\0'),
     ": byte 136: ends within 'vertex' 2 of 3"},
    {ply(PlyEncoding::kBigEndian, {ply_vertices({{0, 0, 0}, {0, INFINITY, 0}, {0, 1, 0}}), kFace}),
     ": byte 178: coordinate 'inf' is not finite"},
};

/// The header behind the format, and rows.
const BadFiles kBadHeaders = {
    {std::string(900000, 'x') + "\n", ":3: unknown statement"},
    {"elements vertex 3\n", ":3: unknown statement"},
    {"element vertex\n", ":3: element without"},
    {"element vertex -3\n", ":3: element without"},
    {"element vertex 3\nelement vertex 3\n", ":4: second element"},
    {"property float x\n", ":3: property without"},
    {"element vertex 3\nproperty float\n", ":4: property that is not known"},
    {"element vertex 3\nproperty float128 x\n", ":4: property that is not known"},
    {"element vertex 3\nproperty list uchar float x\n", ":3: vertices without x, y or z"},
    {"element vertex 3\nproperty float x\nproperty float z\n", ":3: vertices without x, y or z"},
    {"element face 1\nproperty list list uchar int a\n", ":4: property that is not known"},
    {"element face 1\nproperty list float int a\n", ":4: property that is not known"},
    {"element face 1\nproperty list uchar float vertex_indices\n",
     ":3: faces without vertex_indices"},
    {"element face 1\nproperty int vertex_indices\n", ":3: faces without vertex_indices"},
    {"element face 0\n" + kLists, ": no vertices"},
    {kThree + "end_header\n" + kRows, ": no faces"},
    {"element vertex 99999999999999999999999\n" + kCoordinates,
     ":8: ends within 'vertex' 0 of 18446744073709551615"},
    {"element vertex 4611686018427387904\n" + kCoordinates,
     ":8: ends within 'vertex' 0 of 4611686018427387904"},
    {kThree + "element face 4294967295\n" + kLists + "end_header\n" + kRows,
     ":13: ends within 'face' 0 of 4294967295"},
};

/// The rows of three vertices and a face.
const BadFiles kBadRows = {
    {"0 0 0\n1 0\n0 1 0\n3 0 1 2\n", ":11: more or fewer values than 'vertex' has"},
    {"0 0 0\n1 0 0 5\n0 1 0\n3 0 1 2\n", ":11: more or fewer values than 'vertex' has"},
    {"0 0 0\n1 0 " + std::string(1000000, 'x') + "\n0 1 0\n3 0 1 2\n", ":11: 'xxx"},
    {"0 0 0\n1,5 0 0\n0 1 0\n3 0 1 2\n", ":11: '1,5' is not a number; write decimals with a point"},
    {"0 0 0\n1 \0 0\n0 1 0\n3 0 1 2\n"s, ":11: '\\x00' is not"},
    {"0 0 0\n1 nan 0\n0 1 0\n3 0 1 2\n", ":11: coordinate 'nan' is not finite"},
    {"0 0 0\n1e400 0 0\n0 1 0\n3 0 1 2\n", ":11: coordinate 'inf' is not finite"},
    {"0 0 0\n1 0 0\n0 2e30 0\n3 0 1 2\n", ":12: coordinate '2e+30' is beyond 1e30"},
    {"0 0 0\n1.0000000000 0 0\n", ":12: ends within 'vertex' 2 of 3"},
    {kRows + "3 0 1 3\n", ":13: vertex 3 of 3"},
    {kRows + "3 0 -1 2\n", ":13: vertex -1 of 3"},
    {kRows + "3 0 1.0 2\n", ":13: '1.0' is not a whole number"},
    {kRows + "3 0 1 " + std::string(30, '9') + "\n", ":13: vertex 1000000000000000000 of 3"},
    {kRows + "-3 0 1 2\n", ":13: list of -3 entries"},
    {kRows + "4294967295 0 1 2\n", ":13: more or fewer values than 'face' has"},
    {kRows + "3 0 1 2 2\n", ":13: more or fewer values than 'face' has"},
    {kRows + "1 0   \n", ":13: face of 1 corner"},
    {kRows + "0     \n", ":13: face of 0 corners"},
    {kRows + "3 0 1\n2\n", ":13: more or fewer values than 'face' has"},
};

void expect_refused(const std::string& bytes, const std::string& begin) {
    SCOPED_TRACE(begin);
    const auto error = error_of([&] { read_ply(TemporaryFolder().write("a.ply", bytes)); });
    ASSERT_TRUE(error);
    EXPECT_EQ(error->kind(), ErrorKind::kBadInput);
    const std::string message = error->what();
    EXPECT_TRUE(has(message, "a.ply" + begin));
    EXPECT_TRUE(has(message, "; "));
    EXPECT_FALSE(has(message, "\n"));
    EXPECT_LT(message.size(), 350u);
}

TEST(PlyHostile, BadFilesAreRefusedWithPlaceAndReason) {
    for (const auto& [bytes, begin] : kBadFiles) expect_refused(bytes, begin);
    const std::string head = "ply\nformat ascii 1.0\n";
    for (const auto& [statements, begin] : kBadHeaders)
        expect_refused(head + statements + (has(statements, "end_header") ? "" : "end_header\n"),
                       begin);
    for (const auto& [rows, begin] : kBadRows)
        expect_refused(ply_header(PlyEncoding::kText, {kVertices, kFace}) + rows, begin);
    std::string many = head + "element vertex 3\n";
    for (int i = 0; i < 120000; ++i) many += fmt::format("property char p{}\n", i);
    expect_refused(many, ":");
}

/// A file with everything that is read and some that is not.
std::string small_file(PlyEncoding encoding) {
    const PlyItems vertices = {"vertex",
                               {"float x", "double y", "short z", "uchar red", "float green",
                                "uchar blue", "float nx", "float ny", "float nz"},
                               {{0, 0, 0, 1, 1, 1, 0, 0, 1},
                                {1, 0, 0, 1, 1, 1, 0, 0, 1},
                                {0, 1, 0, 1, 1, 1, 0, 0, 1},
                                {1, 1, 0, 1, 1, 1, 0, 0, 1}}};
    const PlyItems other = {"other", {"list ushort char a", "int b"}, {{2, 1, 1, 1}, {0, 2}}};
    const PlyItems faces = {"face",
                            {"list uchar int vertex_indices", "uchar c"},
                            {{3, 0, 1, 2, 1}, {4, 0, 1, 3, 2, 1}}};
    return ply(encoding, {vertices, other, faces});
}

/// The file of these bytes. Writing over a file waits for the disk, so the one before is removed.
std::filesystem::path written(const TemporaryFolder& folder, const std::string& bytes) {
    std::filesystem::remove(folder.file("a.ply"));
    return folder.write("a.ply", bytes);
}

/// Whether the file is accepted. Fails for errors of other kinds.
bool is_read(const std::filesystem::path& path) {
    const auto error = error_of([&] { read_ply(path); });
    EXPECT_TRUE(!error || error->kind() == ErrorKind::kBadInput) << error->what();
    return !error;
}

TEST(PlyHostile, FilesCutAtAnyByteAreRefused) {
    const TemporaryFolder folder;
    for (const PlyEncoding encoding : kPlyEncodings) {
        const std::string whole = small_file(encoding);
        ASSERT_TRUE(is_read(written(folder, whole)));
        for (std::size_t size = 0; size < whole.size(); ++size) {
            const bool accepted = is_read(written(folder, whole.substr(0, size)));
            // Without its line end a text is complete.
            const bool complete = encoding == PlyEncoding::kText && size + 1 == whole.size();
            EXPECT_EQ(accepted, complete) << ply_format(encoding) << " cut to " << size;
        }
    }
}

}  // namespace
}  // namespace mray
