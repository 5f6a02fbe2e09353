#include "app/files/image_files.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <span>
#include <string>

#include "common/base/errors.h"
#include "common/base/input_file.h"
#include "common/text/text.h"
#include "morphray/mesh.hpp"

namespace mray::app {
namespace {

// No image within the limits is larger, but for texts that it may have.
constexpr std::uint64_t kMostBytes = std::uint64_t{1} << 30;

constexpr ImageLimits kLimits = {.side = morphray::kMaxTextureSide};

/// The name of an image in messages: "scene.gltf: images[0]" for a part of a file.
std::filesystem::path name_of(const TextureFile& file) {
    return file.place.empty() ? file.path : file.path + ": " + file.place;
}

void require_part(const TextureFile& file, std::uint64_t bytes) {
    if (file.size <= kMostBytes && file.offset <= bytes && file.size <= bytes - file.offset) return;
    throw Error(ErrorKind::kBadInput, "{}: bytes {} to {} are no image", escape(name_of(file)),
                file.offset, file.offset + file.size);
}

}  // namespace

void ImageLimits::require(const std::filesystem::path& path, std::uint64_t width,
                          std::uint64_t height) const {
    if (std::max(width, height) > side || width * height > pixels) {
        throw Error(
            ErrorKind::kLimit,
            "{}: has {}x{} pixels; at most {} a side and {} in all can be read, make it smaller",
            escape(path), width, height, side, pixels);
    }
}

void refuse_image(const std::filesystem::path& path, const char* format, const std::string& what) {
    if (what.find("memory") != std::string::npos) throw std::bad_alloc();
    throw Error(ErrorKind::kBadInput,
                "{}: is not a {} file that can be read ({}); give another file", escape(path),
                format, what);
}

std::string texture_bytes(const TextureFile& file) {
    if (file.content) {
        require_part(file, file.content->size());
        return file.content->substr(file.offset, file.size);
    }
    if (file.size == 0) return read_input_file(file.path, kMostBytes);
    const InputFile whole(file.path);
    require_part(file, whole.size());
    std::string bytes(file.size, '\0');
    whole.read(file.offset, std::as_writable_bytes(std::span(bytes)));
    return bytes;
}

Image read_texture(const TextureFile& file) {
    const std::filesystem::path name = name_of(file);
    const std::string bytes = texture_bytes(file);
    if (is_png(bytes)) return decode_png(bytes, name, kLimits);
    if (is_jpeg(bytes)) return decode_jpeg(bytes, name, kLimits);
    throw Error(ErrorKind::kBadInput, "{}: is neither a PNG nor a JPEG file; convert it",
                escape(name));
}

std::vector<Image> read_textures(const SceneTextures& textures, bool lenient,
                                 const Messages& messages) {
    std::vector<Image> images;
    for (const TextureFile& file : textures.files) {
        try {
            images.push_back(read_texture(file));
        } catch (const Error& error) {
            if (!lenient || error.kind() != ErrorKind::kBadInput) throw;
            Warning warning = as_warning(error, escape(file.path));
            warning.text += "; its faces have no texture";
            messages.warn(warning);
            images.push_back({1, 1, {0xFFFFFFFF}});
        }
    }
    return images;
}

}  // namespace mray::app
