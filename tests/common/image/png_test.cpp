// PNG files, read back by a decoder that shares no code with the encoder.
#include <gtest/gtest.h>
#include <png.h>

#include <random>
#include <stdexcept>
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
    const std::vector<PngText> texts = {{"Source", "morphray render 'na\xC3\xAFve.obj'"},
                                        {"Comment", ""}};
    const Image decoded = decode(encode_png(image, texts));
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

}  // namespace
}  // namespace mray
