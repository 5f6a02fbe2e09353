// The only file that sees stb_image_write.
#include <cassert>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <new>

#include "common/image.h"

namespace {

// stb goes on writing through a null pointer when memory runs out.
void* checked_malloc(std::size_t size) {
    void* memory = std::malloc(size);
    if (memory == nullptr) throw std::bad_alloc();
    return memory;
}

void* checked_realloc(void* old, std::size_t size) {
    void* memory = std::realloc(old, size);
    if (memory == nullptr) throw std::bad_alloc();
    return memory;
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
#define STBIW_REALLOC(old, size) checked_realloc(old, size)
#define STBIW_FREE(memory) std::free(memory)
#include <stb/stb_image_write.h>
#pragma GCC diagnostic pop

namespace morphray {
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

struct Free {
    void operator()(unsigned char* memory) const { std::free(memory); }
};

}  // namespace

std::vector<std::byte> encode_png(const Image& image) {
    assert(image.width > 0 && image.height > 0);
    assert(image.pixels.size() == std::size_t{image.width} * image.height);
    const int count = is_opaque(image) ? 3 : 4;
    const int width = static_cast<int>(image.width);
    const std::vector<unsigned char> bytes = channels(image, static_cast<std::size_t>(count));
    int size = 0;
    const std::unique_ptr<unsigned char, Free> file(stbi_write_png_to_mem(
        bytes.data(), width * count, width, static_cast<int>(image.height), count, &size));
    if (file == nullptr) throw std::bad_alloc();
    std::vector<std::byte> result(static_cast<std::size_t>(size));
    std::memcpy(result.data(), file.get(), result.size());
    return result;
}

}  // namespace morphray
