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
    /// Kd, taken as linear and rounded to 8 bits.
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

/// The materials of an MTL text by their names, the first of a name, as tinyobjloader reads them.
/// `unread` counts colours that are not read, or not as they are. Throws Error(kBadInput) for
/// binary data.
MaterialMap read_mtl_text(std::string_view text, const std::filesystem::path& library,
                          WarningCount& unread);

/// Gives faces colours and textures, which lie where libraries name them or beside these.
class ObjMaterials {
public:
    /// `path` is the OBJ file. Keeps references to all three.
    ObjMaterials(const std::filesystem::path& path, const MeshFileOptions& options, FileMesh& mesh);

    /// Adds the materials of the libraries that a line names: one name, which may have blanks, or
    /// else several. A library that cannot be read is a warning.
    void read_libraries(std::string_view names);
    /// Gives the next faces a material; the default, if the name is not known.
    void use(std::string_view name);
    /// Colours the next face of the mesh. Null stands for corners without texture coordinates.
    void add_face(std::span<const Texcoord* const> texcoords);
    /// Gives the warnings, once all faces have been added.
    void finish();

private:
    void read_library(const std::filesystem::path& library);
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
    WarningCount odd_colours_;
    WarningCount unknown_;
    WarningCount missing_;
    WarningCount without_texcoords_;
};

}  // namespace mray
