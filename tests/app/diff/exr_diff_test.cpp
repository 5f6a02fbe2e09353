// The comparison of OpenEXR files, and files that are refused.
#include <gtest/gtest.h>

#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfDeepFrameBuffer.h>
#include <OpenEXR/ImfDeepScanLineOutputFile.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfMultiPartOutputFile.h>
#include <OpenEXR/ImfOutputFile.h>
#include <OpenEXR/ImfPartType.h>
#include <OpenEXR/ImfTiledOutputFile.h>

#include <algorithm>
#include <cstring>
#include <limits>
#include <nlohmann/json.hpp>
#include <random>

#include "app/files/exr_reader.h"
#include "common/base/errors.h"
#include "tests/app/program.h"
#include "tests/support/thrown_error.h"

namespace mray::test {
namespace {

using Json = nlohmann::json;

constexpr int kWidth = 20;
constexpr int kHeight = 10;
constexpr std::size_t kCount = kWidth * kHeight;

/// The planes of a file, all of kWidth x kHeight.
struct Planes {
    std::vector<float> red = std::vector<float>(kCount, 0.25f);
    std::vector<float> depth = std::vector<float>(kCount, 8);
    std::vector<unsigned> prim = std::vector<unsigned>(kCount, 7);
    std::vector<half> normal = std::vector<half>(kCount, half(0.5f));
};

template <class T>
Imf::Slice slice(Imf::PixelType type, const std::vector<T>& plane, Imath::V2i origin = {0, 0}) {
    return Imf::Slice::Make(type, plane.data(), origin, kWidth, kHeight);
}

std::string write_exr(const TemporaryFolder& folder, const std::string& name, const Planes& planes,
                      Imf::Compression compression = Imf::ZIP_COMPRESSION,
                      Imath::V2i origin = {0, 0}) {
    const Imath::Box2i window(origin, {origin.x + kWidth - 1, origin.y + kHeight - 1});
    Imf::Header header(window, window);
    header.compression() = compression;
    Imf::FrameBuffer buffer;
    const auto add = [&](const char* channel, Imf::PixelType type, const auto& plane) {
        header.channels().insert(channel, Imf::Channel(type));
        buffer.insert(channel, slice(type, plane, origin));
    };
    add("R", Imf::FLOAT, planes.red);
    add("depth.Z", Imf::FLOAT, planes.depth);
    add("id.prim", Imf::UINT, planes.prim);
    add("normal.X", Imf::HALF, planes.normal);
    const std::string path = folder.file(name);
    Imf::OutputFile file(path.c_str(), header);
    file.setFrameBuffer(buffer);
    file.writePixels(kHeight);
    return path;
}

/// A file with one channel of the type.
std::string write_channel(const TemporaryFolder& folder, const std::string& file_name,
                          const char* channel, Imf::PixelType type, int x_sampling = 1) {
    Imf::Header header(kWidth, kHeight);
    header.channels().insert(channel, Imf::Channel(type, x_sampling, 1));
    const std::vector<unsigned> zeros(kCount);
    Imf::FrameBuffer buffer;
    const std::size_t size = type == Imf::HALF ? 2 : 4;
    buffer.insert(channel,
                  Imf::Slice(type, const_cast<char*>(reinterpret_cast<const char*>(zeros.data())),
                             size, size * kWidth, x_sampling, 1));
    const std::string path = folder.file(file_name);
    Imf::OutputFile file(path.c_str(), header);
    file.setFrameBuffer(buffer);
    file.writePixels(kHeight);
    return path;
}

TEST(ExrDiff, FindsEqualImagesEqualHoweverTheyArePacked) {
    const TemporaryFolder folder;
    const std::string a = write_exr(folder, "a.exr", {});
    for (const Imf::Compression compression :
         {Imf::NO_COMPRESSION, Imf::RLE_COMPRESSION, Imf::ZIPS_COMPRESSION, Imf::PIZ_COMPRESSION}) {
        const std::string b = write_exr(folder, "b.EXR", {}, compression, {-3, 70});
        const Outcome outcome = run({"diff", a, b, "--out", folder.file("none")});
        EXPECT_EQ(outcome.code, 0) << outcome.err;
        EXPECT_EQ(outcome.out, "OpenEXR image of 20x10: equal bit by bit\n");
    }
    EXPECT_FALSE(std::filesystem::exists(folder.file("none")));
}

TEST(ExrDiff, CountsPixelsByKindAndNamesTheLargestDifferenceOfEachChannel) {
    const TemporaryFolder folder;
    const std::string a = write_exr(folder, "a.exr", {});
    Planes changed;
    changed.red[3 * kWidth + 4] = 0.5f;
    changed.red[5 * kWidth + 6] = 1.25f;
    changed.prim[5 * kWidth + 6] = 4294967295u;
    changed.depth[5 * kWidth + 6] = std::numeric_limits<float>::infinity();
    changed.depth[7 * kWidth + 8] = std::nextafter(8.0f, 9.0f);
    const std::string b = write_exr(folder, "b.exr", changed);
    const Outcome text = run({"diff", a, b, "--out", folder.file("images")});
    EXPECT_EQ(text.code, 1) << text.err;
    for (const char* part :
         {"OpenEXR image of 20x10: 3 pixels differ of 200: 1 prim_id, 1 t, 1 colour\n",
          "R              float  2 pixels, at most 1, by +1 at pixel 6,5\n",
          "depth.Z        float  2 pixels, at most 9.53674e-07, by +9.53674e-07 at pixel 8,7; 1 "
          "not "
          "finite\n",
          "id.prim        uint   1 pixel, the first at 6,5\n", "normal.X       half   equal\n",
          "  pixel 4,3\n    R              expected 0x1p-2, actual 0x1p-1\n",
          "    id.prim        expected 7, actual 4294967295\n",
          "    depth.Z        expected 0x1p+3, actual 0x1.000002p+3\n"}) {
        EXPECT_NE(text.out.find(part), std::string::npos) << part << text.out;
    }
    EXPECT_TRUE(read_file(folder.file("images") + "/difference.png").starts_with("\x89PNG"));
    const Json json = Json::parse(run({"diff", a, b, "--json", "-"}).out);
    EXPECT_EQ(json["equal"], false);
    EXPECT_EQ(json["differing_pixels"], 3);
    EXPECT_EQ(json["differences"]["prim_id"], 1);
    EXPECT_EQ(json["differences"]["t"], 1);
    EXPECT_EQ(json["differences"]["colour"], 1);
    EXPECT_EQ(json["channels"]["R"]["difference"], 1.0);
    EXPECT_EQ(json["channels"]["R"]["pixel"], Json({6, 5}));
    EXPECT_EQ(json["channels"]["depth.Z"]["not_finite"], 1);
    EXPECT_EQ(json["channels"]["id.prim"]["kind"], "prim_id");
    EXPECT_EQ(json["first"].size(), 3u);
    EXPECT_EQ(json["first"][1]["actual"]["id.prim"], "4294967295");
}

TEST(ExrDiff, ComparesBitsOfZerosAndNaNs) {
    const TemporaryFolder folder;
    Planes a;
    Planes b;
    a.red[0] = 0.0f;
    b.red[0] = -0.0f;
    const std::uint32_t kNaNs[] = {0x7fc00000u, 0x7fc00001u};
    std::memcpy(&a.red[1], &kNaNs[0], 4);
    std::memcpy(&b.red[1], &kNaNs[1], 4);
    std::memcpy(&a.red[2], &kNaNs[0], 4);
    std::memcpy(&b.red[2], &kNaNs[0], 4);
    const Outcome outcome =
        run({"diff", write_exr(folder, "a.exr", a), write_exr(folder, "b.exr", b)});
    EXPECT_EQ(outcome.code, 1);
    for (const char* part : {"2 pixels differ of 200: 2 colour", "expected 0x0p+0, actual -0x0p+0",
                             "expected nan 0x7fc00000, actual nan 0x7fc00001"})
        EXPECT_NE(outcome.out.find(part), std::string::npos) << part << outcome.out;
}

TEST(ExrDiff, TellsOfChannelsAndTypesThatOneFileHasAlone) {
    const TemporaryFolder folder;
    const std::string half_red = write_channel(folder, "half.exr", "R", Imf::HALF);
    const std::string float_red = write_channel(folder, "float.exr", "R", Imf::FLOAT);
    const std::string green = write_channel(folder, "green.exr", "G", Imf::HALF);
    const Outcome types = run({"diff", half_red, float_red});
    EXPECT_EQ(types.code, 1);
    EXPECT_NE(types.out.find("half in " + half_red + ", but float in " + float_red),
              std::string::npos)
        << types.out;
    const Outcome names = run({"diff", half_red, green});
    EXPECT_EQ(names.code, 1);
    EXPECT_NE(names.out.find("only in " + half_red), std::string::npos) << names.out;
    EXPECT_NE(names.out.find("only in " + green), std::string::npos) << names.out;
    const Json json = Json::parse(run({"diff", half_red, green, "--json", "-"}).out);
    EXPECT_EQ(json["channels"]["R"]["actual_type"], nullptr);
    EXPECT_EQ(json["channels"]["R"]["expected_type"], "half");
    EXPECT_EQ(json["differing_pixels"], 0);
    EXPECT_EQ(json["equal"], false);
}

TEST(ExrDiff, ComparesFilesOfRender) {
    const TemporaryFolder folder;
    for (const char* frame : {"8", "9"}) {
        const Outcome made =
            run({"render", "builtin:cloth:500", "--backend", "cpu", "--frame", frame, "--size",
                 "40x30", "--exr", "half", "-q", "-o", folder.file(frame) + std::string(".png")});
        ASSERT_EQ(made.code, 0) << made.err;
    }
    EXPECT_EQ(run({"diff", folder.file("8.exr"), folder.file("8.exr"), "-q"}).code, 0);
    const Outcome other = run({"diff", folder.file("8.exr"), folder.file("9.exr")});
    EXPECT_EQ(other.code, 1);
    for (const char* channel : {"barycentric.U", "depth.Z", "id.prim", "normal.X", "occlusion.Y"})
        EXPECT_NE(other.out.find(channel), std::string::npos) << other.out;
}

std::string write_tiled(const TemporaryFolder& folder) {
    Imf::Header header(kWidth, kHeight);
    header.channels().insert("R", Imf::Channel(Imf::FLOAT));
    header.setTileDescription(Imf::TileDescription(8, 8));
    const Planes planes;
    Imf::FrameBuffer buffer;
    buffer.insert("R", slice(Imf::FLOAT, planes.red));
    const std::string path = folder.file("tiled.exr");
    Imf::TiledOutputFile file(path.c_str(), header);
    file.setFrameBuffer(buffer);
    file.writeTiles(0, file.numXTiles() - 1, 0, file.numYTiles() - 1);
    return path;
}

std::string write_parts(const TemporaryFolder& folder) {
    std::vector<Imf::Header> headers(2, Imf::Header(kWidth, kHeight));
    for (std::size_t i = 0; i < headers.size(); ++i) {
        headers[i].channels().insert("R", Imf::Channel(Imf::FLOAT));
        headers[i].setName(i == 0 ? "left" : "right");
        headers[i].setType(Imf::SCANLINEIMAGE);
    }
    const std::string path = folder.file("parts.exr");
    const Imf::MultiPartOutputFile file(path.c_str(), headers.data(), 2);
    return path;
}

std::string write_deep(const TemporaryFolder& folder) {
    Imf::Header header(kWidth, kHeight);
    header.channels().insert("Z", Imf::Channel(Imf::FLOAT));
    header.setType(Imf::DEEPSCANLINE);
    header.compression() = Imf::ZIPS_COMPRESSION;
    const std::string path = folder.file("deep.exr");
    const Imf::DeepScanLineOutputFile file(path.c_str(), header);
    return path;
}

/// The bytes with the four numbers of an attribute that is a box replaced.
std::string with_window(std::string bytes, std::array<std::int32_t, 4> window) {
    for (const char* name : {"dataWindow", "displayWindow"}) {
        const std::string head = std::string(name) + '\0' + "box2i" + '\0';
        const std::size_t at = bytes.find(head);
        EXPECT_NE(at, std::string::npos);
        std::memcpy(bytes.data() + at + head.size() + 4, window.data(), sizeof window);
    }
    return bytes;
}

TEST(ExrDiff, RefusesWhatCannotBeCompared) {
    const TemporaryFolder folder;
    const std::string a = write_exr(folder, "a.exr", {});
    const std::string bytes = read_file(a);
    const auto expect_refused = [&](const std::string& other, int code, const std::string& text) {
        const Outcome outcome = run({"diff", a, other});
        EXPECT_EQ(outcome.code, code) << outcome.err;
        EXPECT_EQ(lines(outcome.err).size(), 1u) << outcome.err;
        EXPECT_TRUE(outcome.err.starts_with(other)) << outcome.err;
        EXPECT_NE(outcome.err.find(text), std::string::npos) << outcome.err;
        EXPECT_EQ(outcome.out, "");
    };
    expect_refused(folder.file("none.exr"), 3, "no such file");
    expect_refused(folder.write("empty.exr", ""), 3, "too early");
    expect_refused(folder.write("text.exr", "hello, world"), 3, "does not begin like one");
    expect_refused(folder.write("head.exr", bytes.substr(0, 60)), 3, "too early");
    expect_refused(folder.write("cut.exr", bytes.substr(0, bytes.size() - 9)), 3,
                   "not an OpenEXR file that can be read");
    expect_refused(folder.write("hits", "hello"), 3, "two OpenEXR files");
    expect_refused(folder.write("image.png", "hello"), 3, "two OpenEXR files");
    expect_refused(write_tiled(folder), 3, "tiles instead of scan lines");
    expect_refused(write_parts(folder), 3, "several parts");
    expect_refused(write_deep(folder), 3, "deep pixels");
    expect_refused(write_channel(folder, "thin.exr", "R", Imf::FLOAT, 2), 3,
                   "no value for some pixels");
    const auto claiming = [&](const std::string& name, std::array<std::int32_t, 4> window) {
        // Room for a table of the places of all blocks, each of them 0.
        const std::string table(1 << 17, '\0');
        return folder.write(name, with_window(bytes, window) + table).native();
    };
    expect_refused(claiming("square.exr", {0, 0, 59999, 59999}), 6, "60000x60000 pixels");
    expect_refused(claiming("wide.exr", {-2147483647, 0, 2147483646, 0}), 3, "");
    expect_refused(claiming("high.exr", {0, 0, 0, 100000}), 6, "1x100001 pixels");
    expect_refused(claiming("inverted.exr", {5, 5, 0, 0}), 3, "");
    expect_refused(claiming("small.exr", {0, 0, 3, 3}), 3, "only images of the same size");
    expect_refused(claiming("large.exr", {0, 0, 16383, 16383}), 3, "only images of the same size");
    std::string attribute = bytes;
    const std::string head = std::string("compression") + '\0' + "compression" + '\0';
    std::memset(attribute.data() + attribute.find(head) + head.size(), 0x7f, 4);
    expect_refused(folder.write("attribute.exr", attribute), 3, "too early");
}

TEST(ExrReader, ReadsOrRefusesEveryDamagedFile) {
    const TemporaryFolder folder;
    const std::string bytes = read_file(write_exr(folder, "a.exr", {}));
    std::size_t refused = 0;
    std::size_t read = 0;
    const auto attempt = [&](const std::string& damaged) {
        const std::filesystem::path path = folder.write("b.exr", damaged);
        try {
            app::ExrReader reader(path);
            // Larger images would be refused by diff.
            if (reader.height() <= 2 * kHeight && reader.width() <= 2 * kWidth)
                reader.read_rows(0, reader.height());
            ++read;
        } catch (const Error& error) {
            EXPECT_TRUE(error.kind() == ErrorKind::kBadInput || error.kind() == ErrorKind::kLimit)
                << error.what();
            ++refused;
        }
    };
    for (std::size_t size = 0; size < bytes.size(); ++size) attempt(bytes.substr(0, size));
    EXPECT_EQ(read, 0u);
    std::mt19937 random(7);
    for (int i = 0; i < 600; ++i) {
        std::string damaged = bytes;
        for (unsigned k = 0; k <= random() % 3; ++k)
            damaged[random() % damaged.size()] = static_cast<char>(random());
        attempt(damaged);
    }
    EXPECT_GT(refused, bytes.size());
    EXPECT_GT(read, 5u);
}

TEST(ExrReader, RefusesAttributesOfAnotherSizeThanTheirType) {
    const TemporaryFolder folder;
    const std::string bytes = read_file(write_exr(folder, "a.exr", {}));
    // The size stands behind the type, little-endian. With it the rest of the header would be read
    // from another place than it was checked at.
    for (const char* const type : {"box2i", "chlist", "compression", "float", "lineOrder", "v2f"}) {
        SCOPED_TRACE(type);
        std::string damaged = bytes;
        const std::string word = std::string(1, '\0') + type + '\0';
        const std::size_t at = damaged.rfind(word);
        ASSERT_NE(at, std::string::npos);
        ++damaged[at + word.size()];
        const std::filesystem::path path = folder.write("b.exr", damaged);
        const std::string message = message_of([&] { app::ExrReader{path}; });
        EXPECT_NE(message.find(std::string("an attribute of type ") + type + " has another size"),
                  std::string::npos)
            << message;
    }
}

TEST(ExrReader, EscapesNamesInMessages) {
    const TemporaryFolder folder;
    std::string bytes = read_file(write_exr(folder, "a.exr", {}));
    // The channel R gets another name, and a type that is none.
    const std::string channel = std::string("chlist") + '\0';
    const std::size_t at = bytes.find(channel) + channel.size() + 4;
    ASSERT_EQ(bytes[at], 'R');
    bytes[at] = '\n';
    bytes[at + 2] = 9;
    const std::filesystem::path path = folder.write("b.exr", bytes);
    const std::string message = message_of([&] { app::ExrReader{path}; });
    EXPECT_EQ(message.find('\n'), std::string::npos) << message;
    EXPECT_NE(message.find("\\x0A"), std::string::npos) << message;
}

}  // namespace
}  // namespace mray::test
