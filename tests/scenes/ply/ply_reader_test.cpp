#include "scenes/ply/ply_reader.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <limits>

#include "scenes/animation.h"
#include "tests/scenes/ply/ply_files.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/thrown_error.h"

namespace mray {
namespace {

using namespace test;

const std::vector<std::vector<double>> kCorners = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
const PlyItems kSquare = ply_vertices(kCorners);
const PlyItems kTwoFaces = ply_faces({{3, 0, 1, 2}, {4, 0, 1, 2, 3}});
const std::vector<std::uint32_t> kTwoFacesCorners = {0, 1, 2, 0, 1, 2, 3};

struct Reading {
    FileMesh mesh;
    std::vector<std::string> warnings;
};

Reading read(const std::string& bytes, MeshFileOptions options = {}) {
    const TemporaryFolder folder;
    Reading reading;
    options.warn = [&](const Warning& warning) { reading.warnings.push_back(warning.line()); };
    reading.mesh = read_ply(folder.write("a.ply", bytes), options);
    return reading;
}

std::unique_ptr<Animation> open(const std::string& bytes, const char* name = "a.ply") {
    const TemporaryFolder folder;
    return open_scene(folder.write(name, bytes).native());
}

void expect_the_square(const std::string& bytes) {
    const Reading reading = read(bytes);
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
        const Reading reading = read(text);
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
        const Reading reading =
            read(ply(encoding, {ply_vertices(corners), faces}), {.lenient = true});
        EXPECT_TRUE(std::isnan(reading.mesh.positions[1].y));
        EXPECT_EQ(reading.mesh.positions[2].z, 1e31f);
        EXPECT_EQ(reading.mesh.faces.corners, (std::vector<std::uint32_t>{0, 1, 2, 1, 2, 3}));
        ASSERT_EQ(reading.warnings.size(), 2u);
        EXPECT_NE(reading.warnings[0].find("left out (and 4 more)"), std::string::npos);
        EXPECT_NE(reading.warnings[1].find("kept as it is (and 1 more)"), std::string::npos);
        EXPECT_EQ(kind_of([&] { read(ply(encoding, {kSquare}), {.lenient = true}); }),
                  ErrorKind::kBadInput);
    }
}

TEST(PlySequence, AnimationsAndCachesAreThoseOfObjFiles) {
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
    std::string cache("POINTCACHE2\0\1\0\0\0\4\0\0\0\0\0\0\0\0\0\x80\x3f\1\0\0\0", 32);
    cache += ply_body(PlyEncoding::kLittleEndian,
                      {ply_vertices({{5, 6, 7}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}})});
    const auto animation =
        open_scene(folder.file("c/f_0005.ply"), {.cache = folder.write("a.pc2", cache).native()});
    std::vector<vec3> positions(4);
    animation->positions(0, positions);
    EXPECT_EQ(positions[0], vec3(5, 6, 7));
}

}  // namespace
}  // namespace mray
