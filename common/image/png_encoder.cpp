// The only file that includes stb_image_write and zlib, which compresses for it.
#include <zlib.h>

#include <cassert>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <mutex>
#include <new>
#include <string>
#include <utility>
#include <vector>

#include "common/image/png.h"

namespace {

// stb writes through a null pointer if memory runs out, so this throws instead.
void* checked_malloc(std::size_t size) {
    void* memory = std::malloc(size);
    if (memory == nullptr) throw std::bad_alloc();
    return memory;
}

// On images of flat triangles stb's own compressor makes more bytes and takes several times as
// long. A higher level makes fewer, but takes longer than that is worth.
constexpr int kLevel = 3;

/// Replaces stb's compressor and ignores its level. The caller frees the result with std::free.
unsigned char* compress_bytes(unsigned char* bytes, int size, int* compressed_size, int) {
    uLongf room = compressBound(static_cast<uLong>(size));
    auto* const out = static_cast<unsigned char*>(checked_malloc(room));
    if (compress2(out, &room, bytes, static_cast<uLong>(size), kLevel) != Z_OK) {
        std::free(out);
        throw std::bad_alloc();  // nothing else can go wrong
    }
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
#define STBIW_MALLOC(size) checked_malloc(size)
#define STBIW_REALLOC(old, size) std::realloc(old, size)  // by its compressor alone
#define STBIW_FREE(memory) std::free(memory)
#define STBIW_ZLIB_COMPRESS compress_bytes
#include <stb/stb_image_write.h>
#pragma GCC diagnostic pop

namespace mray {
namespace {

/// The pixels as bytes in file order: three a pixel when all are opaque, else four.
std::vector<unsigned char> channels(const Image& image, std::size_t count) {
    std::vector<unsigned char> bytes(image.pixels.size() * count);
    unsigned char* out = bytes.data();
    for (const std::uint32_t pixel : image.pixels) {
        for (std::size_t i = 0; i < count; ++i) {
            *out++ = static_cast<unsigned char>(pixel >> (8 * i));
        }
    }
    return bytes;
}

bool is_opaque(const Image& image) {
    for (const std::uint32_t pixel : image.pixels) {
        if (pixel >> 24 != 255) return false;
    }
    return true;
}

// The signature and the chunk IHDR.
constexpr std::size_t kHeaderBytes = 8 + 25;

void append(const void* bytes, std::size_t size, std::vector<std::byte>& to) {
    const std::size_t at = to.size();
    to.resize(at + size);
    std::memcpy(to.data() + at, bytes, size);
}

void append_word(std::uint32_t word, std::vector<std::byte>& to) {
    const unsigned char bytes[] = {
        static_cast<unsigned char>(word >> 24), static_cast<unsigned char>(word >> 16),
        static_cast<unsigned char>(word >> 8), static_cast<unsigned char>(word)};
    append(bytes, sizeof bytes, to);
}

/// Adds the text as a chunk (ISO/IEC 15948, 11.3.4.5): not compressed, in no particular language.
void append_text(const PngText& text, std::vector<std::byte>& to) {
    const std::string chunk = "iTXt" + text.keyword + std::string(5, '\0') + text.text;
    append_word(static_cast<std::uint32_t>(chunk.size() - 4), to);
    append(chunk.data(), chunk.size(), to);
    append_word(static_cast<std::uint32_t>(crc32(0, reinterpret_cast<const Bytef*>(chunk.data()),
                                                 static_cast<uInt>(chunk.size()))),
                to);
}

struct Free {
    void operator()(unsigned char* memory) const { std::free(memory); }
};

struct Png {
    std::unique_ptr<unsigned char, Free> bytes;
    std::size_t size;
};

constexpr int kNoFilter = 0;
constexpr int kFilterForEachRow = -1;

Png make_png(const Image& image, const std::vector<unsigned char>& bytes, int count, int filter) {
    static std::mutex one_at_a_time;  // stb takes the filter from a variable of its own
    const std::lock_guard lock(one_at_a_time);
    stbi_write_force_png_filter = filter;
    const int width = static_cast<int>(image.width);
    int size = 0;
    Png png{};
    png.bytes.reset(stbi_write_png_to_mem(bytes.data(), width * count, width,
                                          static_cast<int>(image.height), count, &size));
    if (png.bytes == nullptr) throw std::bad_alloc();
    png.size = static_cast<std::size_t>(size);
    return png;
}

}  // namespace

std::vector<std::byte> encode_png(const Image& image, std::span<const PngText> texts) {
    assert(image.width > 0 && image.height > 0);
    assert(image.pixels.size() == std::size_t{image.width} * image.height);
    const int count = is_opaque(image) ? 3 : 4;
    const std::vector<unsigned char> bytes = channels(image, static_cast<std::size_t>(count));
    // Flat triangles repeat themselves, which differences between pixels would hide; what does not
    // may be smooth.
    Png png = make_png(image, bytes, count, kNoFilter);
    if (png.size > bytes.size() / 2) {
        Png filtered = make_png(image, bytes, count, kFilterForEachRow);
        if (filtered.size < png.size) png = std::move(filtered);
    }
    std::vector<std::byte> result;
    append(png.bytes.get(), kHeaderBytes, result);
    for (const PngText& text : texts) append_text(text, result);
    append(png.bytes.get() + kHeaderBytes, png.size - kHeaderBytes, result);
    return result;
}

}  // namespace mray
