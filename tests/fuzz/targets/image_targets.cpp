// Images that are read: PNG files of `diff`, textures.
#include <cstdint>
#include <string>

#include "app/files/image_files.h"
#include "tests/fuzz/targets/outcome.h"
#include "tests/fuzz/targets/targets.h"

namespace mray::fuzz {
namespace {

/// The limits of textures, and small, since compressed files of few bytes may have many pixels.
constexpr app::ImageLimits kLimits = {.side = 4096, .pixels = 1 << 16, .reduce_16_bits = true};

std::string image_failure(const Image& image) {
    return image.pixels.size() == std::size_t{image.width} * image.height && !image.pixels.empty()
               ? ""
               : "an image of another size than it has pixels";
}

}  // namespace

std::string png_failure(std::string_view bytes) {
    static const std::string name = "case.png";
    const std::string copy(bytes);
    for (const bool reduces : {false, true}) {
        app::ImageLimits limits = kLimits;
        limits.reduce_16_bits = reduces;
        std::string failure =
            failure_of(name, [&] { return image_failure(app::decode_png(copy, name, limits)); });
        if (!failure.empty()) return failure;
    }
    return {};
}

std::string jpeg_failure(std::string_view bytes) {
    static const std::string name = "case.jpg";
    const std::string copy(bytes);
    return failure_of(name, [&] { return image_failure(app::decode_jpeg(copy, name, kLimits)); });
}

}  // namespace mray::fuzz
