#include <zlib.h>

#include <algorithm>
#include <cassert>
#include <new>

#include "common/image/png.h"

namespace mray {
namespace {

// A higher level makes fewer bytes, but takes longer than that is worth.
constexpr int kLevel = 3;

/// A big-endian number.
std::string word(std::uint64_t number) {
    std::string bytes;
    for (int shift = 24; shift >= 0; shift -= 8) bytes += static_cast<char>(number >> shift);
    return bytes;
}

/// A chunk (ISO/IEC 15948, 5.3).
std::string chunk(const std::string& type, const std::string& data) {
    const std::string both = type + data;
    return word(data.size()) + both +
           word(crc32_z(0, reinterpret_cast<const Bytef*>(both.data()), both.size()));
}

/// The rows of pixels, each after a zero: differences would hide that flat triangles repeat.
std::string rows_of(const Image& image, int channels) {
    std::string rows;
    rows.reserve(image.pixels.size() * static_cast<std::size_t>(channels) + image.height);
    for (std::size_t i = 0; i < image.pixels.size(); ++i) {
        if (i % image.width == 0) rows += '\0';
        for (int k = 0; k < channels; ++k) rows += static_cast<char>(image.pixels[i] >> 8 * k);
    }
    return rows;
}

std::string compressed(const std::string& bytes) {
    uLongf size = compressBound(bytes.size());
    std::string result(size, '\0');
    if (compress2(reinterpret_cast<Bytef*>(result.data()), &size,
                  reinterpret_cast<const Bytef*>(bytes.data()), bytes.size(), kLevel) != Z_OK)
        throw std::bad_alloc();
    result.resize(size);
    return result;
}

}  // namespace

std::vector<std::byte> encode_png(const Image& image, std::span<const PngText> texts) {
    assert(image.width > 0 && image.height > 0);
    assert(image.pixels.size() == std::size_t{image.width} * image.height);
    const bool is_opaque =
        std::ranges::all_of(image.pixels, [](std::uint32_t pixel) { return pixel >> 24 == 255; });
    const std::string format = {8, is_opaque ? '\2' : '\6', 0, 0, 0};
    std::string png = "\x89PNG\r\n\x1A\n";
    png += chunk("IHDR", word(image.width) + word(image.height) + format);
    // Texts are not compressed, and in no particular language (11.3.4.5).
    for (const PngText& text : texts)
        png += chunk("iTXt", text.keyword + std::string(5, '\0') + text.text);
    png += chunk("IDAT", compressed(rows_of(image, is_opaque ? 3 : 4)));
    png += chunk("IEND", "");
    const auto bytes = std::as_bytes(std::span(png));
    return {bytes.begin(), bytes.end()};
}

}  // namespace mray
