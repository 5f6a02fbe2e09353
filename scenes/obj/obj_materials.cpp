#include "scenes/obj/obj_materials.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/base/errors.h"
#include "common/base/input_file.h"
#include "common/text/number_text.h"
#include "common/text/text_parts.h"
#include "scenes/obj/obj_lines.h"

namespace mray {
namespace {

constexpr std::string_view kBlanks = " \t\f";
constexpr Albedo kWhite = 0x00FFFFFF;

std::string_view take_word(std::string_view& rest) {
    const std::string_view word = rest.substr(0, rest.find_first_of(kBlanks));
    rest = trimmed(rest.substr(word.size()), kBlanks);
    return word;
}

/// Takes one to three finite numbers for u, v and w. Returns whether there are any.
bool take_numbers(std::string_view& rest, std::array<float, 2>& numbers) {
    std::size_t count = 0;
    for (std::string_view after = rest; count < 3; rest = after, ++count) {
        const float number = parse_float(take_word(after)).value_or(NAN);
        // The last word is the file.
        if (!std::isfinite(number) || after.empty()) break;
        if (count < numbers.size()) numbers[count] = number;
    }
    return count > 0;
}

/// Takes an option of map_Kd with its values. Returns false for one that is not known, or without
/// them.
bool take_option(std::string_view& rest, TextureMap& map) {
    const std::string_view option = take_word(rest);
    if (option == "-s") return take_numbers(rest, map.scale);
    if (option == "-o") return take_numbers(rest, map.offset);
    if (option != "-clamp") return false;
    const std::string_view value = take_word(rest);
    map.clamp = value == "on";
    return map.clamp || value == "off";
}

/// Reads `[-option value ...] file`; a file name may have blanks in it and quotes around it.
/// Returns false if there is none, or an option that is not read.
bool read_map(std::string_view rest, TextureMap& map) {
    while (rest.starts_with('-'))
        if (!take_option(rest, map)) return false;
    if (rest.size() > 1 && rest.front() == '"' && rest.back() == '"')
        rest = rest.substr(1, rest.size() - 2);
    map.file = rest;
    std::replace(map.file.begin(), map.file.end(), '\\', '/');
    return !rest.empty();
}

/// Nothing unless there are three finite numbers, or one that stands for all.
std::optional<Albedo> read_kd(std::string_view rest) {
    std::array<float, 3> kd = {};
    std::size_t count = 0;
    for (auto word = next_word(rest); !word.empty(); word = next_word(rest)) {
        const float number = parse_float(word).value_or(NAN);
        if (count == kd.size() || !std::isfinite(number)) return std::nullopt;
        kd[count++] = number;
    }
    if (count == 1) return albedo_of(kd[0], kd[0], kd[0]);
    return count == 3 ? std::optional(albedo_of(kd[0], kd[1], kd[2])) : std::nullopt;
}

}  // namespace

void read_mtl_text(std::string_view text, const std::filesystem::path& library,
                   const std::string& name, const WarnFunction& warn, MaterialMap& materials) {
    WarningCount odd;
    Material left_out;
    Material* material = &left_out;
    for (ObjLines lines(text, name); !lines.at_end();) {
        std::string_view rest = trimmed(lines.next(), kBlanks);
        const std::string_view keyword = take_word(rest);
        const auto warn_of = [&](const char* what) {
            odd.add([&] {
                return Warning{lines.place(),
                               fmt::format("{} {} {}; left out", keyword, quote(rest), what)};
            });
        };
        if (keyword == "newmtl") {
            const auto [place, is_new] = materials.try_emplace(std::string(rest));
            material = is_new ? &place->second : &left_out;
        } else if (keyword == "Kd") {
            if (const auto albedo = read_kd(rest))
                material->albedo = albedo;
            else
                warn_of("is not three finite numbers");
        } else if (keyword == "map_Kd" || keyword == "map_kd") {
            TextureMap map{.place = lines.place(), .library = library};
            if (read_map(rest, map))
                material->map = std::move(map);
            else
                warn_of("names no file, or has an option or value that is not read");
        }
    }
    odd.tell(warn);
}

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
            return Warning{name_, as_warning(error, name_).text + "; its materials are grey"};
        });
        return;
    }
    read_mtl_text(bytes, library, escape(library), options_.warn, materials_);
}

void ObjMaterials::use(std::string_view name) {
    current_ = &default_;
    if (options_.positions_only) return;
    name = trimmed(name, kBlanks);
    const auto found = materials_.find(std::string(name));
    if (found == materials_.end()) {
        return unknown_.add([&] {
            return Warning{name_, fmt::format("material {} is in no library; faces that use it are "
                                              "grey",
                                              quote(name))};
        });
    }
    Material& material = found->second;
    if (!std::exchange(material.is_used, true) && material.map)
        material.texture = texture_of(*material.map);
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
    mesh_.albedo.push_back(is_textured && material.albedo.value_or(0) == 0
                               ? kWhite
                               : material.albedo.value_or(kDefaultAlbedo));
    if (mesh_.textures.empty()) return;
    has_textured_faces_ |= is_textured;
    mesh_.face_textures.push_back(is_textured ? material.texture : kNoTexture);
    for (const Texcoord* const at : texcoords) {
        Texcoord& texcoord = mesh_.texcoords.emplace_back();
        if (!is_textured) continue;
        texcoord.u = at->u * material.map->scale[0] + material.map->offset[0];
        texcoord.v = at->v * material.map->scale[1] + material.map->offset[1];
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

/// The index of the map's texture, or kNoTexture with a warning if there is no such file.
std::uint32_t ObjMaterials::texture_of(const TextureMap& map) {
    TextureFile file{.clamp = map.clamp};
    std::string problem;
    for (const std::string& name : {map.file, map.file.substr(map.file.rfind('/') + 1)}) {
        try {
            file.path = side_file(map.library, name).native();
            break;
        } catch (const Error& error) {
            // The message names the file as the library does.
            if (problem.empty()) problem = as_warning(error, escape(map.library)).text;
        }
    }
    if (file.path.empty()) {
        missing_.add([&] {
            return Warning{map.place,
                           fmt::format("map_Kd: {}; its faces have no texture", problem)};
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
