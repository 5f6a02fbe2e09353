// Materials of MTL libraries, and those that an OBJ file uses.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <unordered_map>

#include "scenes/mesh/mesh_file.h"
#include "scenes/mesh/mesh_rules.h"

namespace mray {

struct Material {
    /// Kd, taken as linear, clamped to [0, 1] and rounded to 8 bits.
    std::optional<Albedo> albedo = {};
    /// The file of map_Kd, as the library names it, with / for each backslash; empty: none.
    std::string map = {};
    bool clamp = false;
    /// Texture coordinates are multiplied by `scale`, then `offset` is added.
    std::array<float, 2> scale = {1, 1};
    std::array<float, 2> offset = {0, 0};
    /// The library, which file names are relative to.
    std::filesystem::path library = {};
    /// An index of FileMesh::textures once a face uses the material.
    std::uint32_t texture = kNoTexture;
    bool is_used = false;
};

using MaterialMap = std::unordered_map<std::string, Material>;

/// Adds the materials of an MTL text by their names; the first of a name stays. tinyobjloader reads
/// them: numbers that are none are 0. Throws Error(kBadInput) for binary data.
void read_mtl_text(std::string_view text, const std::filesystem::path& library,
                   MaterialMap& materials);

/// Gives faces colours and textures, which lie where libraries name them or beside these.
class ObjMaterials {
public:
    /// `path` is the OBJ file. Keeps references to all three.
    ObjMaterials(const std::filesystem::path& path, const MeshFileOptions& options, FileMesh& mesh);

    /// Adds the materials of a library. One that cannot be read is a warning.
    void read_library(std::string_view name);
    /// Gives the next faces a material; the default, if the name is not known.
    void use(std::string_view name);
    /// Colours the next face of the mesh. Null stands for corners without texture coordinates.
    void add_face(std::span<const Texcoord* const> texcoords);
    /// Gives the warnings, once all faces have been added.
    void finish();

private:
    std::uint32_t texture_of(const Material& material);

    const std::filesystem::path& path_;
    const MeshFileOptions& options_;
    FileMesh& mesh_;
    const std::string name_;
    std::set<std::filesystem::path> libraries_;
    MaterialMap materials_;
    const Material default_;
    const Material* current_ = &default_;
    bool has_textured_faces_ = false;
    WarningCount unread_;
    WarningCount unknown_;
    WarningCount missing_;
    WarningCount without_texcoords_;
};

}  // namespace mray
