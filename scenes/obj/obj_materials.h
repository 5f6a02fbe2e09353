// Materials of MTL libraries, and those that an OBJ file uses.
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>
#include <vector>

#include "common/base/errors.h"
#include "common/base/input_file.h"
#include "common/text/text_parts.h"
#include "scenes/mesh/mesh_file.h"
#include "scenes/warning_count.h"

namespace mray {

/// A `map_Kd` statement. Texture coordinates are multiplied by `scale`, then `offset` is added.
struct TextureMap {
    /// As the library names it, with / for each backslash.
    std::string file;
    bool clamp = false;
    std::array<float, 2> scale = {1, 1};
    std::array<float, 2> offset = {0, 0};
    /// "file:line" of the statement.
    std::string place;
    /// The library, which file names are relative to.
    std::filesystem::path library;
};

struct Material {
    Albedo albedo = kClay;
    /// The albedo below the texture: white where the library has no Kd, or a black one.
    Albedo textured_albedo = 0x00FFFFFF;
    /// Null without a texture.
    std::shared_ptr<const TextureMap> map;
};

using MaterialMap = std::unordered_map<std::string, Material>;

/// More than a library of a million materials takes.
inline constexpr std::uint64_t kMaxMtlBytes = std::uint64_t{256} << 20;

/// Adds the materials of an MTL text to `materials`, by their names without the blanks around them;
/// the first of several materials of one name stays. The albedo is Kd, taken as linear, clamped to
/// [0, 1] and rounded to 8 bits; kClay without a Kd. Of the options of map_Kd, -s, -o and
/// -clamp are read.
///
/// `library` is the file, `name` the same in messages. Throws Error(kBadInput) for NUL bytes. A Kd
/// without three finite numbers, and a map_Kd with other options, are left out with a warning.
void read_mtl_text(std::string_view text, const std::filesystem::path& library,
                   const std::string& name, const WarnFunction& warn, MaterialMap& materials);

/// Reads material libraries and gives faces their colours and textures. A texture is searched where
/// its library names it and, if it is not there or not in the folder of the library, by its file
/// name beside the library.
class ObjMaterials {
public:
    /// `path` is the OBJ file. Keeps references to all three.
    ObjMaterials(const std::filesystem::path& path, const MeshFileOptions& options, FileMesh& mesh)
        : path_(path), options_(options), mesh_(mesh), name_(escape(path)) {}

    /// Adds the materials of a library. One that cannot be opened is a warning.
    void read_library(const std::string& file) {
        const std::string name(trimmed(file, " \t"));
        if (options_.positions_only || name.empty()) return;
        std::filesystem::path library;
        std::string bytes;
        try {
            library = side_file(path_, name);
            if (!libraries_.insert(library).second) return;
            bytes = read_input_file(library, kMaxMtlBytes);
        } catch (const Error& error) {
            if (error.kind() != ErrorKind::kBadInput) throw;
            unread_.add([&] {
                return Warning{name_, fmt::format("{}; its materials are grey",
                                                  as_warning(error, name_).text)};
            });
            return;
        }
        read_mtl_text(bytes, library, escape(library), options_.warn, materials_);
    }

    /// Gives the next faces a material; the default, if the name is not known.
    void use(std::string_view text) {
        current_ = &default_;
        if (options_.positions_only) return;
        const std::string name(trimmed(text, " \t"));
        const auto material = materials_.find(name);
        if (material == materials_.end()) {
            return unknown_.add([&] {
                return Warning{name_,
                               fmt::format("material {} is in no library; faces that use it are "
                                           "grey",
                                           quote(name))};
            });
        }
        const auto [used, is_new] = used_.try_emplace(name, Used{material->second});
        const TextureMap* const map = material->second.map.get();
        if (is_new && map != nullptr) used->second.texture = texture_of(*map);
        current_ = &used->second;
    }
    /// Colours the next face of the mesh. Null stands for corners without texture coordinates.
    void add_face(std::span<const Texcoord* const> texcoords) {
        const auto& [used, texture] = *current_;
        bool is_textured = texture != kNoTexture;
        if (is_textured &&
            std::find(texcoords.begin(), texcoords.end(), nullptr) != texcoords.end()) {
            is_textured = false;
            without_texcoords_.add([&] {
                return Warning{name_,
                               "face with a texture, but without texture coordinates; has its "
                               "colour alone"};
            });
        }
        mesh_.albedo.push_back(is_textured ? used.textured_albedo : used.albedo);
        if (mesh_.textures.empty()) return;
        has_textured_faces_ |= is_textured;
        mesh_.face_textures.push_back(is_textured ? texture : kNoTexture);
        for (const Texcoord* const at : texcoords) {
            Texcoord& texcoord = mesh_.texcoords.emplace_back();
            if (!is_textured) continue;
            texcoord.u = at->u * used.map->scale[0] + used.map->offset[0];
            texcoord.v = at->v * used.map->scale[1] + used.map->offset[1];
        }
    }
    /// Gives the warnings, once all faces have been added.
    void finish() {
        for (const WarningCount* const warnings :
             {&unread_, &unknown_, &missing_, &without_texcoords_})
            warnings->tell(options_.warn);
        if (has_textured_faces_) return;
        mesh_.textures = {};
        mesh_.face_textures = {};
        mesh_.texcoords = {};
    }

private:
    struct Used {
        Material material = {};
        std::uint32_t texture = kNoTexture;
    };
    /// The index of the map's texture, or kNoTexture with a warning if there is no such file.
    std::uint32_t texture_of(const TextureMap& map) {
        TextureFile file{.clamp = map.clamp};
        try {
            file.path = file_of(map).native();
        } catch (const Error& error) {
            if (error.kind() != ErrorKind::kBadInput) throw;
            missing_.add([&] {
                return Warning{map.place, fmt::format("map_Kd: {}; its faces have no texture",
                                                      as_warning(error, escape(map.library)).text)};
            });
            return kNoTexture;
        }
        const auto same = std::find(mesh_.textures.begin(), mesh_.textures.end(), file);
        const auto texture = static_cast<std::uint32_t>(same - mesh_.textures.begin());
        // Faces before the first texture have none.
        if (mesh_.textures.empty()) {
            mesh_.face_textures.resize(mesh_.faces.corner_counts.size(), kNoTexture);
            mesh_.texcoords.resize(mesh_.faces.corners.size());
        }
        if (same == mesh_.textures.end()) mesh_.textures.push_back(std::move(file));
        return texture;
    }
    std::filesystem::path file_of(const TextureMap& map) {
        try {
            return side_file(map.library, map.file);
        } catch (const Error& error) {
            const std::size_t slash = map.file.rfind('/');
            if (error.kind() != ErrorKind::kBadInput || slash == std::string::npos) throw;
            try {
                return side_file(map.library, map.file.substr(slash + 1));
            } catch (const Error&) {
            }
            // The message names the file as the library does.
            throw;
        }
    }

    const std::filesystem::path& path_;
    const MeshFileOptions& options_;
    FileMesh& mesh_;
    const std::string name_;
    std::set<std::filesystem::path> libraries_;
    MaterialMap materials_;
    std::unordered_map<std::string, Used> used_;
    const Used default_;
    const Used* current_ = &default_;
    bool has_textured_faces_ = false;
    WarningCount unread_;
    WarningCount unknown_;
    WarningCount missing_;
    WarningCount without_texcoords_;
};

}  // namespace mray
