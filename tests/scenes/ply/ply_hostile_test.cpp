// PLY files that are damaged or made to do harm.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <limits>
#include <utility>

#include "scenes/ply/ply_reader.h"
#include "tests/scenes/ply/ply_files.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/thrown_error.h"

namespace mray {
namespace {

using namespace test;

const PlyItems kVertices = ply_vertices({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}});
const PlyItems kFace = ply_faces({{3, 0, 1, 2}});
const std::string kLists = "property list uchar int vertex_indices\n";
const std::string kCoordinates = "property float x\nproperty float y\nproperty float z\n";
const std::string kRows = "0 0 0\n1 0 0\n0 1 0\n";

std::string text_file(const std::string& rows) {
    return ply_header(PlyEncoding::kText, {kVertices, kFace}) + rows;
}
std::string text_header(const std::string& statements) {
    return "ply\nformat ascii 1.0\n" + statements + "end_header\n";
}
/// A binary file of three vertices and one face with these bytes.
std::string binary_face(const std::string& types, const std::string& bytes) {
    const PlyItems face = {"face", {"list " + types + " vertex_indices"}, {{}}};
    return ply_header(PlyEncoding::kLittleEndian, {kVertices, face}) +
           ply_body(PlyEncoding::kLittleEndian, {kVertices}) + bytes;
}

std::string refusal(const std::string& bytes) {
    const TemporaryFolder folder;
    const auto path = folder.write("a.ply", bytes);
    const auto error = error_of([&] { read_ply(path); });
    if (!error) return "";
    EXPECT_EQ(error->kind(), ErrorKind::kBadInput) << error->what();
    const std::string message = error->what();
    return message.substr(message.find("a.ply"));
}

struct BadFile {
    const char* name;
    std::string bytes;
    /// How the message begins, after the name of the file.
    const char* message;
};

const std::string kFewBytes = "\3\0\0\0\0\1\0";

const std::vector<BadFile> kBadFiles = {
    {"empty", "", ":1: not a PLY file"},
    {"html", "<html>\n<body>\n", ":1: not a PLY file"},
    {"png", std::string("\x89PNG\r\n\x1A\n\0\0\0\rIHDR", 16), ":1: not a PLY file"},
    {"obj", "v 0 0 0\nv 1 0 0\n", ":1: not a PLY file"},
    {"first_word_longer", "plyx\nformat ascii 1.0\nend_header\n", ":1: not a PLY file"},
    {"first_line_only", "ply", ":1: no format"},
    {"byte_order_mark", "\xEF\xBB\xBFply\n", ":1: not a PLY file"},
    {"no_end_header", "ply\nformat ascii 1.0\nelement vertex 3\n" + kCoordinates + kRows,
     ":7: unknown statement '0 0 0'"},
    {"ends_in_header", "ply\nformat ascii 1.0\nelement vertex 3\n" + kCoordinates,
     ":7: no end_header"},
    {"header_of_comments", "ply\n" + std::string(std::size_t{2} << 20, 'c'), ":2: no end_header"},
    {"header_of_lines",
     [] {
         std::string text = "ply\nformat ascii 1.0\nelement vertex 3\n";
         for (int i = 0; i < 120000; ++i) text += fmt::format("property char p{}\n", i);
         return text;
     }(),
     ":"},
    {"no_format", "ply\nelement vertex 3\n" + kCoordinates + "end_header\n" + kRows,
     ":6: no format"},
    {"format_unknown", "ply\nformat binary_middle_endian 1.0\nend_header\n", ":2: format"},
    {"format_version", "ply\nformat ascii 2.0\nend_header\n", ":2: format"},
    {"format_without_version", "ply\nformat ascii\nend_header\n", ":2: format"},
    {"statement_unknown", text_header("elements vertex 3\n"), ":3: unknown statement"},
    {"statement_long", text_header(std::string(900000, 'x') + "\n"), ":3: unknown statement"},
    {"element_without_count", text_header("element vertex\n"), ":3: element without"},
    {"element_four_words", text_header("element vertex 3 4\n"), ":3: element without"},
    {"element_count_negative", text_header("element vertex -3\n"), ":3: element without"},
    {"element_count_fraction", text_header("element vertex 3.5\n"), ":3: element without"},
    {"element_count_hexadecimal", text_header("element vertex 0x10\n"), ":3: element without"},
    {"element_count_huge",
     text_header("element vertex 99999999999999999999999\n" + kCoordinates) + kRows,
     ":3: 18446744073709551615 items of 'vertex', which"},
    {"element_twice", text_header("element vertex 3\nelement vertex 3\n"), ":4: second element"},
    {"property_without_element", text_header("property float x\n"), ":3: property without"},
    {"property_without_name", text_header("element vertex 3\nproperty float\n"),
     ":4: property that is not known"},
    {"property_type_unknown", text_header("element vertex 3\nproperty float128 x\n"),
     ":4: property that is not known"},
    {"property_list_of_lists",
     text_header("element face 1\nproperty list list uchar int vertex_indices\n"),
     ":4: property that is not known"},
    {"coordinate_list", text_header("element vertex 3\nproperty list uchar float x\n"),
     ":3: vertices without x, y or z"},
    {"coordinate_missing", text_header("element vertex 3\nproperty float x\nproperty float z\n"),
     ":3: vertices without x, y or z"},
    {"count_float", text_header("element face 1\nproperty list float int vertex_indices\n"),
     ":4: property that is not known"},
    {"index_float", text_header("element face 1\nproperty list uchar float vertex_indices\n"),
     ":3: faces without vertex_indices"},
    {"index_scalar", text_header("element face 1\nproperty int vertex_indices\n"),
     ":3: faces without vertex_indices"},
    {"faces_without_list", text_header("element face 1\nproperty int a\n"),
     ":3: faces without vertex_indices"},
    {"no_vertices", text_header("element face 0\n" + kLists), ": no vertices"},
    {"points_only", text_header("element vertex 3\n" + kCoordinates) + kRows, ": no faces"},
    {"vertices_4_gib", text_header("element vertex 4294967295\n" + kCoordinates) + kRows,
     ":3: 4294967295 items of 'vertex', which"},
    {"vertices_2_62", text_header("element vertex 4611686018427387904\n" + kCoordinates) + kRows,
     ":3: 4611686018427387904 items of 'vertex', which"},
    {"faces_4_gib",
     text_header("element vertex 3\n" + kCoordinates + "element face 4294967295\n" + kLists) +
         kRows,
     ":7: 4294967295 items of 'face', which"},
    {"skipped_4_gib", text_header("element other 4294967295\nproperty uchar a\n") + kRows,
     ":3: 4294967295 items of 'other', which"},
    {"row_short", text_file("0 0 0\n1 0\n0 1 0\n3 0 1 2\n"), ":11: fewer values than 'vertex' has"},
    {"row_long", text_file("0 0 0\n1 0 0 5\n0 1 0\n3 0 1 2\n"),
     ":11: more values than 'vertex' has"},
    {"row_of_a_word", text_file("0 0 0\n1 0 " + std::string(1000000, 'x') + "\n0 1 0\n3 0 1 2\n"),
     ":11: 'xxx"},
    {"row_comma", text_file("0 0 0\n1,5 0 0\n0 1 0\n3 0 1 2\n"),
     ":11: '1,5' is not a number; write decimals with a point"},
    {"row_nul", text_file(std::string("0 0 0\n1 \0 0\n0 1 0\n3 0 1 2\n", 26)),
     ":11: '\\x00' is not"},
    {"row_nan", text_file("0 0 0\n1 nan 0\n0 1 0\n3 0 1 2\n"),
     ":11: coordinate 'nan' is not finite"},
    {"row_infinite", text_file("0 0 0\n1 0 -inf\n0 1 0\n3 0 1 2\n"),
     ":11: coordinate '-inf' is not finite"},
    {"row_overflow", text_file("0 0 0\n1e400 0 0\n0 1 0\n3 0 1 2\n"),
     ":11: coordinate 'inf' is not finite"},
    {"row_huge", text_file("0 0 0\n1 0 0\n0 2e30 0\n3 0 1 2\n"),
     ":12: coordinate '2e+30' is beyond 1e30"},
    {"rows_missing", text_file("0 0 0\n1.0000000000 0 0\n"), ":12: ends within 'vertex' 2 of 3"},
    {"face_index_too_large", text_file(kRows + "3 0 1 3\n"), ":13: vertex 3 of 3"},
    {"face_index_negative", text_file(kRows + "3 0 -1 2\n"), ":13: vertex -1 of 3"},
    {"face_index_fraction", text_file(kRows + "3 0 1.0 2\n"), ":13: '1.0' is not a whole number"},
    {"face_index_of_30_digits", text_file(kRows + "3 0 1 " + std::string(30, '9') + "\n"),
     ":13: vertex 1000000000000000000 of 3"},
    {"face_count_negative", text_file(kRows + "-3 0 1 2\n"), ":13: list of -3 entries"},
    {"face_count_too_large", text_file(kRows + "4294967295 0 1 2\n"),
     ":13: fewer values than 'face' has"},
    {"face_count_too_small", text_file(kRows + "3 0 1 2 2\n"), ":13: more values than 'face' has"},
    {"face_of_one", text_file(kRows + "1 0   \n"), ":13: face of 1 corner"},
    {"face_of_none", text_file(kRows + "0     \n"), ":13: face of 0 corners"},
    {"face_short", text_file(kRows + "3 0 1\n3 2\n"), ":13: fewer values than 'face' has"},
    {"binary_face_too_large",
     binary_face("uchar int", std::string("\3\0\0\0\0\1\0\0\0\3\0\0\0", 13)),
     ": byte 205: vertex 3 of 3"},
    {"binary_face_negative",
     binary_face("uchar int", std::string("\3\0\0\0\0\1\0\0\0\xff\xff\xff\xff", 13)),
     ": byte 205: vertex -1 of 3"},
    {"binary_index_2_32",
     binary_face("uchar uint", std::string("\3\0\0\0\0\1\0\0\0\xff\xff\xff\xff", 13)),
     ": byte 206: vertex 4294967295 of 3"},
    {"binary_count_negative",
     binary_face("char int", std::string("\xfd\0\0\0\0\1\0\0\0\2\0\0\0", 13)),
     ": byte 204: list of -3 entries"},
    {"binary_count_4_gib", binary_face("uint uchar", std::string("\xff\xff\xff\xff\0\1\2", 7)),
     ": byte 206: ends within 'face' 0 of 1"},
    {"binary_count_2_31", binary_face("int int", std::string("\xff\xff\xff\x7f\0\1\2", 7)),
     ": byte 203: ends within 'face' 0 of 1"},
    {"binary_face_of_one", binary_face("uchar char", std::string("\1\0", 2)),
     ": byte 206: face of 1 corner"},
    {"binary_face_cut", binary_face("uchar int", kFewBytes),
     ": byte 205: ends within 'face' 0 of 1"},
    {"binary_vertices_cut",
     ply_header(PlyEncoding::kBigEndian, {kVertices}) + std::string(35, '\0'),
     ":3: 3 items of 'vertex', which 35 bytes cannot hold"},
    {"binary_not_finite",
     ply(PlyEncoding::kBigEndian,
         {ply_vertices({{0, 0, 0}, {0, std::numeric_limits<double>::infinity(), 0}, {0, 1, 0}}),
          kFace}),
     ": byte 178: coordinate 'inf' is not finite"},
    {"strip_index_too_large",
     text_header("element vertex 3\n" + kCoordinates +
                 "element tristrips 1\nproperty list uchar int vertex_indices\n") +
         kRows + "4 0 1 2 3\n",
     ":13: vertex 3 of 3"},
    {"strip_of_one",
     text_header("element vertex 3\n" + kCoordinates +
                 "element tristrips 1\nproperty list uchar int vertex_indices\n") +
         kRows + "5 0 1 2 -1 0\n",
     ":13: face of 1 corner"},
};

TEST(PlyHostile, BadFilesAreRefusedWithPlaceAndReason) {
    for (const BadFile& bad : kBadFiles) {
        SCOPED_TRACE(bad.name);
        const std::string message = refusal(bad.bytes);
        EXPECT_TRUE(message.starts_with(std::string("a.ply") + bad.message))
            << message.substr(0, 300);
        EXPECT_NE(message.find("; "), std::string::npos) << message;
        EXPECT_EQ(message.find('\n'), std::string::npos);
        EXPECT_LT(message.size(), 300u);
    }
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
