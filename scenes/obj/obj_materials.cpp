#include "scenes/obj/obj_materials.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <sstream>
#include <utility>
#include <vector>

#define TINYOBJLOADER_IMPLEMENTATION
#include <tiny_obj_loader.h>

#include "common/base/errors.h"
#include "common/base/input_file.h"
#include "common/text/number_text.h"
#include "common/text/text_parts.h"
#include "scenes/obj/obj_lines.h"

namespace mray {
namespace {

namespace fs = std::filesystem;

constexpr Albedo kWhite = 0x00FFFFFF;

/// Tells materials without Kd from black ones.
constexpr const char* kNoColour = "Kd -1\n";

/// The name of a file as a statement has it: in quotes, with "\\ " for blanks, \\ for slashes.
std::string file_name_of(std::string_view text) {
    text = trimmed(text, kBlanks);
    if (text.size() > 1 && text.front() == '"' && text.back() == '"')
        text = text.substr(1, text.size() - 2);
    std::string name;
    for (std::size_t i = 0; i < text.size(); ++i) {
        if (text[i] != '\\')
            name += text[i];
        else if (!text.substr(i + 1).starts_with(' '))
            name += '/';
    }
    return name;
}

/// As side_file(); a file of another folder is searched beside the scene file by its last name.
fs::path find_side_file(const fs::path& scene_file, const std::string& name) {
    try {
        return side_file(scene_file, name);
    } catch (const Error&) {
        try {
            return side_file(scene_file, name.substr(name.rfind('/') + 1));
        } catch (const Error&) {
        }
        throw;
    }
}

/// A number that tinyobjloader, which adds up digits in double precision, rounds to this float.
std::string exact(float number) { return fmt::format(" {:.9g}", number); }

/// A statement Kd of three numbers from 0 to 1, or kNoColour. One number is grey.
std::string full_colour(std::string_view words, WarningCount& clamped,
                        const MeshRules::Place& place) {
    std::string channels;
    for (int i = 0; i < 3; ++i) {
        const std::string_view word = next_word(words);
        if (i == 1 && word.empty()) return fmt::format("Kd{0}{0}{0}\n", channels);
        const std::optional<double> number = parse_double(word);
        if (!number) return kNoColour;
        channels += exact(static_cast<float>(channel_of(*number, 1, clamped, place)));
    }
    return fmt::format("Kd{}\n", channels);
}

/// A statement map_Kd with all the numbers that tinyobjloader takes after an option. Of what is not
/// a number it makes the default.
std::string full_map(std::string_view words) {
    // With the most words they have; all but the first are numbers and may be left out.
    constexpr std::pair<std::string_view, std::size_t> kOptions[] = {
        {"-blendu", 1}, {"-blendv", 1},     {"-bm", 1},      {"-boost", 1}, {"-cc", 1},
        {"-clamp", 1},  {"-colorspace", 1}, {"-imfchan", 1}, {"-mm", 2},    {"-o", 3},
        {"-s", 3},      {"-t", 3},          {"-texres", 1},  {"-type", 1}};
    std::string full = "map_Kd";
    for (;;) {
        std::string_view rest = words;
        const std::string_view option = next_word(rest);
        const auto* const known =
            std::ranges::find(kOptions, option, &std::pair<std::string_view, std::size_t>::first);
        if (known == std::end(kOptions)) return fmt::format("{}{}\n", full, words);
        std::string values;
        for (std::size_t i = 0; i < known->second; ++i) {
            std::string_view after = rest;
            const std::string_view word = next_word(after);
            const std::optional<float> number = parse_float(word);
            const bool is_given = i == 0 || (number && !trimmed(after, kBlanks).empty());
            if (is_given) rest = after;
            const bool is_number = is_given && number && std::isfinite(*number);
            values += is_number ? exact(*number) : word == "on" ? " on" : " off";
        }
        if (option == "-clamp" || option == "-o" || option == "-s")
            full.append(" ").append(option).append(values);
        words = rest;
    }
}

/// Adds what the statements describe, unless there is one of its name. tinyobjloader keeps a
/// kilobyte of each material, so it reads them one by one.
void add_material(const std::string& statements, const fs::path& library, MaterialMap& materials) {
    std::istringstream stream(statements);
    std::map<std::string, int> indices;
    std::vector<tinyobj::material_t> read;
    std::string ignored;
    tinyobj::LoadMtl(&indices, &read, &stream, &ignored, &ignored);
    const tinyobj::material_t& one = read.back();
    if (one.name.empty()) return;
    const auto& kd = one.diffuse;
    const tinyobj::texture_option_t& map = one.diffuse_texopt;
    Material material{.map = file_name_of(one.diffuse_texname),
                      .clamp = map.clamp,
                      .scale = {map.scale[0], map.scale[1]},
                      .offset = {map.origin_offset[0], map.origin_offset[1]},
                      .library = library};
    if (kd[0] >= 0) material.albedo = albedo_of(kd[0], kd[1], kd[2]);
    materials.try_emplace(one.name, std::move(material));
}

}  // namespace

MaterialMap read_mtl_text(std::string_view text, const fs::path& library, WarningCount& unread) {
    MaterialMap materials;
    std::string statements;
    ObjLines lines(text, escape(library));
    const MeshRules::Place place = [&] { return lines.place(); };
    while (!lines.at_end()) {
        const std::string_view statement = lines.next();
        std::string_view rest = statement;
        const std::string_view keyword = next_word(rest);
        if (keyword == "newmtl") {
            add_material(statements, library, materials);
            statements = fmt::format("newmtl {}\n{}", trimmed(rest, kBlanks), kNoColour);
        } else if (keyword == "Kd") {
            const std::string colour = full_colour(rest, unread, place);
            statements += colour;
            if (colour != kNoColour) continue;
            unread.add([&] {
                return Warning{place(), fmt::format("{} is not read; write one number or three",
                                                    quote(statement))};
            });
        } else if (keyword == "map_Kd") {
            statements += full_map(rest);
        }
    }
    add_material(statements, library, materials);
    return materials;
}

ObjMaterials::ObjMaterials(const fs::path& path, const MeshFileOptions& options, FileMesh& mesh)
    : path_(path), options_(options), mesh_(mesh), name_(escape(path)) {}

void ObjMaterials::read_libraries(std::string_view names) {
    if (options_.positions_only) return;
    names = trimmed(names, kBlanks);
    try {
        return read_library(side_file(path_, file_name_of(names)));
    } catch (const Error&) {  // It may be several names.
    }
    while (!names.empty() && names.front() != '#') {
        std::size_t end = 0;
        while (end < names.size() && (!is_blank(names[end]) || names[end - 1] == '\\')) ++end;
        try {
            read_library(find_side_file(path_, file_name_of(names.substr(0, end))));
        } catch (const Error& error) {
            unread_.add([&] {
                return Warning{name_, as_warning(error, name_).text + "; its materials are clay"};
            });
        }
        names = trimmed(names.substr(end), kBlanks);
    }
}

void ObjMaterials::read_library(const fs::path& library) {
    if (libraries_.contains(library)) return;
    MaterialMap read = read_mtl_text(read_input_file(library), library, odd_colours_);
    materials_.merge(read);
    libraries_.insert(library);
}

void ObjMaterials::use(std::string_view name) {
    name = trimmed(name, kBlanks);
    if (options_.positions_only || name.empty()) return;
    current_ = &default_;
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
    for (const WarningCount* const warnings :
         {&unread_, &odd_colours_, &unknown_, &missing_, &without_texcoords_})
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
    try {
        file.path = find_side_file(material.library, material.map).native();
    } catch (const Error& error) {
        missing_.add([&] {
            return Warning{library, fmt::format("map_Kd: {}; its faces have no texture",
                                                as_warning(error, library).text)};
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
