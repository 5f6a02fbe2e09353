#include "scenes/obj/obj_materials.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "common/base/errors.h"
#include "common/base/input_file.h"
#include "common/text/text_parts.h"
#include "scenes/obj/obj_lines.h"

namespace mray {
namespace {

constexpr Albedo kWhite = 0x00FFFFFF;

}  // namespace

ObjMaterials::ObjMaterials(const std::filesystem::path& path, const MeshFileOptions& options,
                           FileMesh& mesh)
    : path_(path), options_(options), mesh_(mesh), name_(escape(path)) {}

void ObjMaterials::read_library(std::string_view name) {
    name = trimmed(name, kBlanks);
    if (options_.positions_only || name.empty()) return;
    std::filesystem::path library;
    std::string bytes;
    try {
        library = side_file(path_, std::string(name));
        if (!libraries_.insert(library).second) return;
        bytes = read_input_file(library);
    } catch (const Error& error) {
        unread_.add([&] {
            return Warning{name_, as_warning(error, name_).text + "; its materials are clay"};
        });
        return;
    }
    read_mtl_text(bytes, library, materials_);
}

void ObjMaterials::use(std::string_view name) {
    current_ = &default_;
    if (options_.positions_only) return;
    name = trimmed(name, kBlanks);
    const auto found = materials_.find(std::string(name));
    if (found == materials_.end()) {
        return unknown_.add([&] {
            return Warning{name_, fmt::format("material {} is in no library; faces that use it are "
                                              "clay",
                                              quote(name))};
        });
    }
    Material& material = found->second;
    if (!std::exchange(material.is_used, true) && !material.map.empty())
        material.texture = texture_of(material);
    current_ = &material;
}

void ObjMaterials::add_face(std::span<const Texcoord* const> texcoords) {
    const Material& material = *current_;
    bool is_textured = material.texture != kNoTexture;
    if (is_textured && std::ranges::find(texcoords, nullptr) != texcoords.end()) {
        is_textured = false;
        without_texcoords_.add([&] {
            return Warning{name_,
                           "face with a texture, but without texture coordinates; has its colour "
                           "alone"};
        });
    }
    // Some exporters write black for materials whose colour is the texture.
    mesh_.albedo.push_back(
        is_textured && material.albedo.value_or(0) == 0 ? kWhite : material.albedo.value_or(kClay));
    if (mesh_.textures.empty()) return;
    has_textured_faces_ |= is_textured;
    mesh_.face_textures.push_back(is_textured ? material.texture : kNoTexture);
    for (const Texcoord* const at : texcoords) {
        Texcoord& texcoord = mesh_.texcoords.emplace_back();
        if (!is_textured) continue;
        texcoord.u = at->u * material.scale[0] + material.offset[0];
        texcoord.v = at->v * material.scale[1] + material.offset[1];
    }
}

void ObjMaterials::finish() {
    for (const WarningCount* const warnings : {&unread_, &unknown_, &missing_, &without_texcoords_})
        warnings->tell(options_.warn);
    if (has_textured_faces_) return;
    mesh_.textures = {};
    mesh_.face_textures = {};
    mesh_.texcoords = {};
}

/// The index of the material's texture, or kNoTexture with a warning if there is no such file.
std::uint32_t ObjMaterials::texture_of(const Material& material) {
    TextureFile file{.clamp = material.clamp};
    const std::string library = escape(material.library);
    std::string problem;
    for (const std::string& name :
         {material.map, material.map.substr(material.map.rfind('/') + 1)}) {
        try {
            file.path = side_file(material.library, name).native();
            break;
        } catch (const Error& error) {
            // The message names the file as the library does.
            if (problem.empty()) problem = as_warning(error, library).text;
        }
    }
    if (file.path.empty()) {
        missing_.add([&] {
            return Warning{library, fmt::format("map_Kd: {}; its faces have no texture", problem)};
        });
        return kNoTexture;
    }
    const auto same = std::ranges::find(mesh_.textures, file);
    const auto texture = static_cast<std::uint32_t>(same - mesh_.textures.begin());
    // Faces before the first texture have none.
    if (mesh_.textures.empty()) {
        mesh_.face_textures.resize(mesh_.faces.corner_counts.size(), kNoTexture);
        mesh_.texcoords.resize(mesh_.faces.corners.size());
    }
    if (same == mesh_.textures.end()) mesh_.textures.push_back(std::move(file));
    return texture;
}

}  // namespace mray
