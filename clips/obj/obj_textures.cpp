#include "clips/obj/obj_textures.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <string_view>

#include "common/base/errors.h"
#include "common/base/input_file.h"
#include "common/text/message_text.h"

namespace mray {
namespace {

namespace fs = std::filesystem;

/// The file beside the library with the name that a path ends in, whatever its folders.
std::optional<fs::path> beside(const TextureMap& map) {
    const std::size_t slash = map.file.rfind('/');
    if (slash == std::string::npos) return std::nullopt;
    try {
        return side_file(map.library, map.file.substr(slash + 1));
    } catch (const Error& error) {
        if (error.kind() != ErrorKind::kBadInput) throw;
        return std::nullopt;
    }
}

Texcoord transformed(const Texcoord& at, const TextureMap& map) {
    return {at.u * map.scale[0] + map.offset[0], at.v * map.scale[1] + map.offset[1]};
}

}  // namespace

ObjTextures::ObjTextures(const std::string& name, const CheckedObj& checked, FileMesh& mesh)
    : name_(name), checked_(checked), mesh_(mesh) {}

void ObjTextures::use(const Material& material) {
    material_ = material;
    texture_ = material.map == nullptr ? kNoTexture : texture_of(*material.map);
}

/// The index of the map's texture, or kNoTexture with a warning if there is no such file.
std::uint32_t ObjTextures::texture_of(const TextureMap& map) {
    const std::string key =
        fmt::format("{}{}:{}", map.clamp ? 'c' : 'r', map.library.native(), map.file);
    const auto known = found_.find(key);
    if (known != found_.end()) return known->second;
    std::uint32_t& texture = found_.emplace(key, kNoTexture).first->second;
    TextureFile file{.clamp = map.clamp};
    try {
        file.path = side_file(map.library, map.file).native();
    } catch (const Error& error) {
        if (error.kind() != ErrorKind::kBadInput) throw;
        const std::optional<fs::path> other = beside(map);
        if (!other) {
            missing_.add([&] {
                return Warning{map.place, fmt::format("map_Kd: {}; its faces have no texture",
                                                      as_warning(error, shown(map.library)).text)};
            });
            return texture;
        }
        file.path = other->native();
    }
    const auto same = std::find(mesh_.textures.begin(), mesh_.textures.end(), file);
    texture = static_cast<std::uint32_t>(same - mesh_.textures.begin());
    if (same == mesh_.textures.end()) mesh_.textures.push_back(std::move(file));
    return texture;
}

Albedo ObjTextures::add_face(std::span<const std::uint32_t> texcoords) {
    bool is_textured = texture_ != kNoTexture;
    if (is_textured &&
        std::find(texcoords.begin(), texcoords.end(), kNoAttribute) != texcoords.end()) {
        is_textured = false;
        without_texcoords_.add([&] {
            return Warning{name_,
                           "face with a texture, but without texture coordinates; has its "
                           "colour alone"};
        });
    }
    if (is_textured && !is_used_) begin(texcoords.size());
    if (is_used_) {
        mesh_.face_textures.push_back(is_textured ? texture_ : kNoTexture);
        for (const std::uint32_t index : texcoords) {
            mesh_.texcoords.push_back(
                is_textured ? transformed(checked_.texcoords[index], *material_.map) : Texcoord{});
        }
    }
    return is_textured ? material_.textured_albedo : material_.albedo;
}

/// Makes the arrays those of the faces before the current one, which has this many corners: without
/// textures they take no memory.
void ObjTextures::begin(std::size_t corners) {
    is_used_ = true;
    mesh_.face_textures.reserve(checked_.face_count);
    mesh_.texcoords.reserve(checked_.corner_count);
    mesh_.face_textures.resize(mesh_.albedo.size(), kNoTexture);
    mesh_.texcoords.resize(mesh_.faces.corners.size() - corners);
}

void ObjTextures::finish(const WarnFunction& warn) {
    missing_.tell(warn);
    without_texcoords_.tell(warn);
    if (is_used_) {
        checked_.odd_texcoords.tell(warn);
    } else {
        mesh_.textures = {};
    }
}

}  // namespace mray
