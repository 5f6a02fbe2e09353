#include "app/files/texture_reader.h"

#include <fmt/format.h>

#include <filesystem>
#include <span>
#include <string>

#include "app/files/jpeg_reader.h"
#include "app/files/png_reader.h"
#include "common/base/errors.h"
#include "common/base/input_file.h"
#include "common/text/message_text.h"
#include "morphray/mesh.hpp"

namespace mray::app {
namespace {

// No image within the limits is larger, but for texts that it may have.
constexpr std::uint64_t kMostBytes = std::uint64_t{1} << 30;

constexpr ImageLimits kLimits = {
    .side = morphray::kMaxTextureSide,
    // The pixels, and what the library makes of them: a copy and its smaller levels.
    .bytes_per_pixel = 10,
    .reduce_16_bits = true,
};

std::string bytes_of(const TextureFile& file) {
    if (file.size == 0) return read_input_file(file.path, kMostBytes);
    const InputFile whole(file.path);
    if (file.size > kMostBytes || file.offset > whole.size() ||
        file.size > whole.size() - file.offset) {
        throw Error(ErrorKind::kBadInput,
                    fmt::format("{}: bytes {} to {} are no image", shown(file.path), file.offset,
                                file.offset + file.size));
    }
    std::string bytes(file.size, '\0');
    whole.read(file.offset, std::as_writable_bytes(std::span(bytes)));
    return bytes;
}

}  // namespace

Image read_texture(const TextureFile& file) {
    const std::filesystem::path path = file.path;
    const std::string bytes = bytes_of(file);
    if (is_png(bytes)) return decode_png(bytes, path, kLimits);
    if (is_jpeg(bytes)) return decode_jpeg(bytes, path, kLimits);
    throw Error(ErrorKind::kBadInput,
                fmt::format("{}: is neither a PNG nor a JPEG file; convert it", shown(path)));
}

std::vector<Image> read_textures(const SceneTextures& textures, bool lenient,
                                 const Messages& messages) {
    std::vector<Image> images;
    for (const TextureFile& file : textures.files) {
        try {
            images.push_back(read_texture(file));
        } catch (const Error& error) {
            if (!lenient || error.kind() != ErrorKind::kBadInput) throw;
            Warning warning = as_warning(error, shown(file.path));
            warning.text += "; its faces have no texture";
            messages.warn(warning);
            images.push_back({1, 1, {0xFFFFFFFF}});
        }
    }
    return images;
}

}  // namespace mray::app
