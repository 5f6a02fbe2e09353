// The only file that includes stb_image_write and zlib, which compresses for it.
#include <zlib.h>

#include <algorithm>
#include <cassert>
#include <cstdlib>
#include <memory>
#include <new>
#include <string>
#include <vector>

#include "common/image/png.h"

namespace {

// On images of flat triangles stb's own compressor makes more bytes and takes several times as
// long. A higher level makes fewer, but takes longer than that is worth.
constexpr int kLevel = 3;

/// Replaces stb's compressor and ignores its level. The caller frees the result with std::free.
unsigned char* compress_bytes(unsigned char* bytes, int size, int* compressed_size, int) {
    uLongf room = compressBound(static_cast<uLong>(size));
    auto* const out = static_cast<unsigned char*>(std::malloc(room));
    if (out == nullptr) throw std::bad_alloc();
    compress2(out, &room, bytes, static_cast<uLong>(size), kLevel);
    *compressed_size = static_cast<int>(room);
    return out;
}

}  // namespace

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wunused-function"
#pragma GCC diagnostic ignored "-Wconversion"
#pragma GCC diagnostic ignored "-Wshadow"
#pragma GCC diagnostic ignored "-Wmissing-field-initializers"
#pragma GCC diagnostic ignored "-Wold-style-cast"
#define STB_IMAGE_WRITE_IMPLEMENTATION
#define STB_IMAGE_WRITE_STATIC
#define STBI_WRITE_NO_STDIO
#define STBIW_ZLIB_COMPRESS compress_bytes
#include <stb/stb_image_write.h>
#pragma GCC diagnostic pop

namespace mray {
namespace {

/// The pixels as bytes in file order.
std::vector<unsigned char> channels(const Image& image, int count) {
    std::vector<unsigned char> bytes(image.pixels.size() * static_cast<std::size_t>(count));
    auto out = bytes.begin();
    for (const std::uint32_t pixel : image.pixels) {
        for (int i = 0; i < count; ++i) *out++ = static_cast<unsigned char>(pixel >> 8 * i);
    }
    return bytes;
}

// The signature and the chunk IHDR.
constexpr std::size_t kHeaderBytes = 8 + 25;

/// A big-endian number.
std::string word(std::uint32_t number) {
    std::string bytes;
    for (int shift = 24; shift >= 0; shift -= 8) bytes += static_cast<char>(number >> shift);
    return bytes;
}

/// The text as a chunk (ISO/IEC 15948, 11.3.4.5): not compressed, in no particular language.
std::string text_chunk(const PngText& text) {
    const std::string chunk = "iTXt" + text.keyword + std::string(5, '\0') + text.text;
    const auto size = static_cast<std::uint32_t>(chunk.size());
    const uLong crc = crc32(0, reinterpret_cast<const Bytef*>(chunk.data()), size);
    return word(size - 4) + chunk + word(static_cast<std::uint32_t>(crc));
}

}  // namespace

std::vector<std::byte> encode_png(const Image& image, std::span<const PngText> texts) {
    assert(image.width > 0 && image.height > 0);
    assert(image.pixels.size() == std::size_t{image.width} * image.height);
    const bool is_opaque =
        std::ranges::all_of(image.pixels, [](std::uint32_t pixel) { return pixel >> 24 == 255; });
    const int count = is_opaque ? 3 : 4;
    const std::vector<unsigned char> pixels = channels(image, count);
    // Flat triangles repeat themselves, which differences between pixels would hide.
    [[maybe_unused]] static const int filter = stbi_write_force_png_filter = 0;
    const int width = static_cast<int>(image.width);
    int size = 0;
    const std::unique_ptr<unsigned char, decltype(&std::free)> png(
        stbi_write_png_to_mem(pixels.data(), width * count, width, static_cast<int>(image.height),
                              count, &size),
        &std::free);
    if (png == nullptr) throw std::bad_alloc();
    const auto* const bytes = reinterpret_cast<const std::byte*>(png.get());
    std::vector<std::byte> result(bytes, bytes + kHeaderBytes);
    for (const PngText& text : texts) {
        const std::string chunk = text_chunk(text);
        for (const char c : chunk) result.push_back(static_cast<std::byte>(c));
    }
    result.insert(result.end(), bytes + kHeaderBytes, bytes + size);
    return result;
}

}  // namespace mray
