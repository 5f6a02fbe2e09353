// PNG files, read back by a decoder that shares no code with the encoder.
#include <gtest/gtest.h>
#include <png.h>

#include <cstring>
#include <random>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "common/image/png.h"

namespace mray {
namespace {

/// Random pixels in which `set_bits` are set.
Image noise(std::uint32_t width, std::uint32_t height, std::uint32_t set_bits, unsigned seed) {
    std::mt19937 random(seed);
    Image image{width, height, {}};
    for (std::size_t i = 0; i < std::size_t{width} * height; ++i) {
        image.pixels.push_back(static_cast<std::uint32_t>(random()) | set_bits);
    }
    return image;
}

Image decode(const std::vector<std::byte>& file) {
    png_image png = {};
    png.version = PNG_IMAGE_VERSION;
    if (!png_image_begin_read_from_memory(&png, file.data(), file.size())) {
        throw std::runtime_error(png.message);
    }
    png.format = PNG_FORMAT_RGBA;
    Image image{png.width, png.height, {}};
    image.pixels.resize(std::size_t{png.width} * png.height);
    if (!png_image_finish_read(&png, nullptr, image.pixels.data(), 0, nullptr)) {
        throw std::runtime_error(png.message);
    }
    return image;
}

void expect_round_trip(const Image& image) {
    const Image decoded = decode(encode_png(image));
    EXPECT_EQ(decoded.width, image.width);
    EXPECT_EQ(decoded.height, image.height);
    EXPECT_EQ(decoded.pixels, image.pixels);
}

TEST(Png, DecodesToTheSamePixels) {
    for (const auto& [width, height] :
         {std::pair{1u, 1u}, {2u, 1u}, {1u, 3u}, {7u, 5u}, {255u, 3u}, {300u, 200u}}) {
        SCOPED_TRACE(testing::Message() << width << "x" << height);
        expect_round_trip(noise(width, height, 0xFF000000, width));
        expect_round_trip(noise(width, height, 0, width));
    }
}

/// The texts of a PNG file, by libpng.
std::vector<std::pair<std::string, std::string>> texts_in(const std::vector<std::byte>& file) {
    png_structp png = png_create_read_struct(PNG_LIBPNG_VER_STRING, nullptr, nullptr, nullptr);
    png_infop info = png_create_info_struct(png);
    std::vector<std::pair<std::string, std::string>> texts;
    if (setjmp(png_jmpbuf(png)) == 0) {
        std::pair<const std::byte*, std::size_t> rest{file.data(), file.size()};
        png_set_read_fn(png, &rest, [](png_structp reader, png_bytep to, png_size_t size) {
            auto& from =
                *static_cast<std::pair<const std::byte*, std::size_t>*>(png_get_io_ptr(reader));
            if (size > from.second) png_error(reader, "too short");
            std::memcpy(to, from.first, size);
            from = {from.first + size, from.second - size};
        });
        png_read_png(png, info, PNG_TRANSFORM_IDENTITY, nullptr);
        png_textp text = nullptr;
        const int count = png_get_text(png, info, &text, nullptr);
        for (int i = 0; i < count; ++i) texts.emplace_back(text[i].key, text[i].text);
    }
    png_destroy_read_struct(&png, &info, nullptr);
    return texts;
}

TEST(Png, TextsAreReadByOthers) {
    const Image image = noise(17, 5, 0xFF000000u, 3);
    const std::vector<PngText> texts = {{"Software", "morphray"},
                                        {"Source", "morphray render 'na\xC3\xAFve.obj'"},
                                        {"Comment", ""}};
    const std::vector<std::byte> file = encode_png(image, texts);
    EXPECT_EQ(decode(file).pixels, image.pixels);
    const auto found = texts_in(file);
    ASSERT_EQ(found.size(), 3u);
    for (std::size_t i = 0; i < 3; ++i) {
        EXPECT_EQ(found[i].first, texts[i].keyword);
        EXPECT_EQ(found[i].second, texts[i].text);
    }
    EXPECT_TRUE(texts_in(encode_png(image)).empty());
}

}  // namespace
}  // namespace mray
