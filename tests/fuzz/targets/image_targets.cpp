// Images that are read: PNG and OpenEXR files of `diff`, textures.
#include <cstdint>
#include <string>

#include "app/files/exr_reader.h"
#include "app/files/image_limits.h"
#include "app/files/jpeg_reader.h"
#include "app/files/png_reader.h"
#include "tests/fuzz/targets/case_file.h"
#include "tests/fuzz/targets/outcome.h"
#include "tests/fuzz/targets/targets.h"

namespace mray::fuzz {
namespace {

/// The limits of textures, and small, since compressed files of few bytes may have many pixels.
constexpr app::ImageLimits kLimits = {
    .side = 4096, .pixels = 1 << 16, .bytes_per_pixel = 10, .reduce_16_bits = true};
// The most values of an OpenEXR file, in all channels, that are read.
constexpr std::uint64_t kMostValues = 1 << 16;

std::string image_failure(const Image& image) {
    return image.pixels.size() == std::size_t{image.width} * image.height && !image.pixels.empty()
               ? ""
               : "an image of another size than it has pixels";
}

/// Reads an OpenEXR file as `diff` does, some rows at a time.
std::string rows_failure(app::ExrReader& reader) {
    constexpr std::uint32_t kRows = 16;
    const std::uint64_t values = std::uint64_t{reader.width()} * reader.channels().size();
    std::uint64_t read = 0;
    for (std::uint32_t row = 0; row < reader.height();) {
        const std::uint32_t count = std::min(kRows, reader.height() - row);
        if ((read += values * count) > kMostValues) break;
        const auto planes = reader.read_rows(row, count);
        if (planes.size() != reader.channels().size()) return "not all channels";
        for (const auto& plane : planes)
            if (plane.size() != std::size_t{reader.width()} * count) return "not all pixels";
        row += count;
    }
    return {};
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

std::string exr_failure(std::string_view bytes) {
    static CaseFile file("case.exr");
    file.write(bytes);
    return failure_of(file.path(), [&] {
        app::ExrReader reader(file.path());
        for (const char* const name : {"Software", "Scene hash", "owner"}) reader.attribute(name);
        return rows_failure(reader);
    });
}

}  // namespace mray::fuzz
