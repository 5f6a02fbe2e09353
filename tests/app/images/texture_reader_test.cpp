// Textures from PNG and JPEG files, good and bad.
#include "app/base/image_files.h"

#include <gtest/gtest.h>
#include <png.h>

#include <random>
#include <string>
#include <utility>
#include <vector>

#include "tests/app/images/image_files.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/thrown_error.h"

namespace mray::app {
namespace {

using namespace test;

std::string bytes_of(const std::vector<std::byte>& file) {
    return {reinterpret_cast<const char*>(file.data()), file.size()};
}

class TextureFiles : public testing::Test {
protected:
    Image read(const std::string& bytes, const std::string& name = "a.png") const {
        return read_texture({.path = folder_.write(name, bytes)});
    }
    std::string refusal(const std::string& bytes) const {
        return test::message_of([&] { read(bytes); });
    }

    TemporaryFolder folder_;
};

TEST_F(TextureFiles, PngOfEveryKindBecomesEightBitsAChannel) {
    for (const auto& [colour, bits] : {std::pair{PNG_COLOR_TYPE_GRAY, 1},
                                       {PNG_COLOR_TYPE_GRAY, 4},
                                       {PNG_COLOR_TYPE_GRAY, 16},
                                       {PNG_COLOR_TYPE_PALETTE, 2},
                                       {PNG_COLOR_TYPE_PALETTE, 8},
                                       {PNG_COLOR_TYPE_RGB, 8},
                                       {PNG_COLOR_TYPE_RGB, 16},
                                       {PNG_COLOR_TYPE_GRAY_ALPHA, 8},
                                       {PNG_COLOR_TYPE_RGBA, 16}}) {
        SCOPED_TRACE(testing::Message() << "type " << colour << ", " << bits << " bits");
        const Image image = read(png_file(11, 6, colour, bits));
        EXPECT_EQ(image.width, 11u);
        EXPECT_EQ(image.height, 6u);
        ASSERT_EQ(image.pixels.size(), 66u);
        // The same through libpng's simplified interface, and interlaced.
        const std::string path = folder_.file("a.png");
        EXPECT_EQ(read(png_file(11, 6, colour, bits, true)).pixels, image.pixels);
        if (bits == 16) continue;  // which that reads as linear
        png_image png = {};
        png.version = PNG_IMAGE_VERSION;
        ASSERT_NE(png_image_begin_read_from_file(&png, path.c_str()), 0);
        png.format = PNG_FORMAT_RGBA;
        std::vector<std::uint32_t> expected(66);
        ASSERT_NE(png_image_finish_read(&png, nullptr, expected.data(), 0, nullptr), 0);
        EXPECT_EQ(image.pixels, expected);
    }
}

TEST_F(TextureFiles, SixteenBitsAreRoundedToEight) {
    const std::string bytes = png_file(1, 1, PNG_COLOR_TYPE_RGB, 16);
    // Its channels are 0x001F, 0x7C17 and 0xF007, of which 255 / 65535 are 0.1, 123.6 and 239.1.
    EXPECT_EQ(read(bytes).pixels[0], 0xFFEF7C00u);
}

TEST_F(TextureFiles, JpegIsReadInRgbAndGreyPlainAndProgressive) {
    for (const bool progressive : {false, true}) {
        for (const int chroma : {1, 2}) {
            const Image image =
                read(jpeg_file(21, 13, {.progressive = progressive, .chroma = chroma}));
            ASSERT_EQ(image.pixels.size(), 21u * 13);
            // Red of the first pixel, and alpha.
            EXPECT_NEAR(image.pixels[0] & 0xFF, 40, chroma == 1 ? 8 : 16);
            EXPECT_EQ(image.pixels[0] >> 24, 255u);
        }
        const Image grey = read(
            jpeg_file(9, 8, {.components = 1, .space = JCS_GRAYSCALE, .progressive = progressive}));
        for (const std::uint32_t pixel : grey.pixels) {
            EXPECT_EQ(pixel & 0xFF, pixel >> 8 & 0xFF);
            EXPECT_EQ(pixel & 0xFF, pixel >> 16 & 0xFF);
        }
    }
}

TEST_F(TextureFiles, NameDoesNotDecideTheKind) {
    EXPECT_EQ(read(jpeg_file(3, 2), "a.png").width, 3u);
    EXPECT_EQ(read(png_file(4, 2, PNG_COLOR_TYPE_RGB, 8), "a.jpg").width, 4u);
    EXPECT_TRUE(has(refusal("GIF89a..."), "a.png: is neither a PNG nor a JPEG file"));
    EXPECT_TRUE(has(refusal(""), "neither"));
}

TEST_F(TextureFiles, CmykIsRefused) {
    const std::string message = refusal(jpeg_file(8, 8, {.components = 4, .space = JCS_CMYK}));
    EXPECT_TRUE(has(message, "save as RGB"));
}

TEST_F(TextureFiles, CutFilesAreRefusedWhereverTheyEnd) {
    for (const std::string& whole :
         {png_file(9, 7, PNG_COLOR_TYPE_RGB, 8), png_file(9, 7, PNG_COLOR_TYPE_PALETTE, 4, true),
          jpeg_file(17, 9), jpeg_file(17, 9, {.progressive = true})}) {
        EXPECT_NO_THROW(read(whole));
        for (std::size_t size = 0; size < whole.size(); ++size) {
            ASSERT_EQ(test::kind_of([&] { read(whole.substr(0, size)); }), ErrorKind::kBadInput)
                << size << " of " << whole.size();
        }
    }
}

TEST_F(TextureFiles, ThePngFilesOfTheProgramHaveTheirPixels) {
    std::mt19937 random(1);
    for (const auto& [width, height] :
         {std::pair{1u, 1u}, {2u, 1u}, {1u, 3u}, {7u, 5u}, {255u, 3u}, {300u, 200u}}) {
        for (const std::uint32_t set_bits : {0xFF000000u, 0u}) {
            Image image{width, height, std::vector<std::uint32_t>(width * height)};
            for (std::uint32_t& pixel : image.pixels)
                pixel = static_cast<std::uint32_t>(random()) | set_bits;
            const PngText texts[] = {{"Source", "render 'na\xC3\xAFve.obj'"}, {"Comment", ""}};
            const Image decoded = read(bytes_of(encode_png(image, texts)));
            EXPECT_EQ(decoded.width, width);
            EXPECT_EQ(decoded.height, height);
            EXPECT_EQ(decoded.pixels, image.pixels) << width << 'x' << height;
        }
    }
}

TEST_F(TextureFiles, JpegWithADamagedByteIsReadOrRefusedButNothingElse) {
    const std::string whole = jpeg_file(17, 9, {.progressive = true});
    for (std::size_t at = 0; at < whole.size(); ++at) {
        std::string bytes = whole;
        bytes[at] = static_cast<char>(bytes[at] ^ 0xFF);
        const auto kind = test::kind_of([&] { read(bytes); });
        EXPECT_TRUE(!kind || kind == ErrorKind::kBadInput || kind == ErrorKind::kLimit) << at;
    }
}

TEST_F(TextureFiles, PngWithADamagedByteAnywhereIsRefusedTextsIncluded) {
    const Image image{
        3, 2, {0xFF000001, 0xFF020304, 0xFF050607, 0xFF08090A, 0xFF0B0C0D, 0xFF0E0F10}};
    const PngText texts[] = {{"Software", "morphray"}, {"Image hash", "0123456789abcdef"}};
    const std::string whole = bytes_of(encode_png(image, texts));
    EXPECT_EQ(read(whole).pixels, image.pixels);
    for (std::size_t at = 0; at < whole.size(); ++at) {
        for (const int flip : {0x01, 0x20, 0x80}) {
            std::string damaged = whole;
            damaged[at] = static_cast<char>(damaged[at] ^ flip);
            EXPECT_EQ(test::kind_of([&] { read(damaged); }), ErrorKind::kBadInput)
                << at << " of " << whole.size();
        }
    }
    std::string damaged = whole;
    damaged[whole.find("morphray")] ^= 1;
    EXPECT_EQ(refusal(damaged),
              folder_.file("a.png") +
                  ": is not a PNG file that can be read (iTXt: CRC error); give another file");
}

/// The head of a small PNG file with another size: bytes 16 to 23 and the chunk's checksum.
std::string png_of_size(const std::string& size) {
    std::string png = png_file(1, 1, PNG_COLOR_TYPE_RGB, 8);
    png.replace(16, 8, size);
    const auto* const chunk = reinterpret_cast<const png_byte*>(png.data()) + 12;
    std::uint32_t crc = 0xFFFFFFFF;
    for (int i = 0; i < 17; ++i) {
        crc ^= chunk[i];
        for (int k = 0; k < 8; ++k) crc = crc >> 1 ^ (crc & 1 ? 0xEDB88320 : 0);
    }
    for (std::size_t i = 0; i < 4; ++i)
        png[29 + i] = static_cast<char>(~crc >> (24 - 8 * i) & 0xFF);
    return png;
}

/// The same of a JPEG file: bytes 5 to 8 of the frame's segment.
std::string jpeg_of_size(const std::string& size) {
    std::string jpeg = jpeg_file(8, 8);
    return jpeg.replace(jpeg.find("\xFF\xC0") + 5, 4, size);
}

TEST_F(TextureFiles, ImagesBeyondTheLimitsAreRefusedByTheirHead) {
    for (const std::string& bytes :
         {png_of_size({"\0\0\xEA\x60\0\0\xEA\x60", 8}), jpeg_of_size("\xEA\x60\xEA\x60")}) {
        EXPECT_EQ(test::kind_of([&] { read(bytes); }), ErrorKind::kLimit);
        EXPECT_TRUE(has(refusal(bytes), "has 60000x60000 pixels; at most 16384 a side"));
    }
}

TEST_F(TextureFiles, FewBytesMayHaveManyPixels) {
    const Image black{4096, 4096, std::vector<std::uint32_t>(4096 * 4096)};
    const std::string png = bytes_of(encode_png(black));
    EXPECT_LT(png.size() * 200, black.pixels.size() * 4);
    EXPECT_EQ(read(png).pixels, black.pixels);
}

TEST_F(TextureFiles, ChunkOfMoreBytesThanTheFileIsRefused) {
    std::string png = png_file(4, 4, PNG_COLOR_TYPE_RGB, 8);
    // A text between the head and the pixels, of 128 MB.
    png.insert(33, std::string("\x08\0\0\x0FzTXta\0\0x", 12));
    EXPECT_EQ(test::kind_of([&] { read(png); }), ErrorKind::kBadInput);
    EXPECT_TRUE(has(refusal(png), "it ends too early"));
}

TEST_F(TextureFiles, FoldersAndMissingFilesAreRefused) {
    EXPECT_EQ(test::kind_of([&] { read_texture({.path = folder_.path()}); }), ErrorKind::kBadInput);
    EXPECT_EQ(test::kind_of([&] { read_texture({.path = folder_.path() / "none.png"}); }),
              ErrorKind::kBadInput);
}

}  // namespace
}  // namespace mray::app
