// The materials that an OBJ file uses.
#pragma once

#include <cstdint>
#include <filesystem>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "scenes/mesh/mesh_file.h"
#include "scenes/obj/mtl_reader.h"
#include "scenes/warning_count.h"

namespace mray {

/// Reads material libraries and gives faces their colours and textures. A texture is searched where
/// its library names it and, if it is not there or not in the folder of the library, by its file
/// name beside the library.
class ObjMaterials {
public:
    /// `path` is the OBJ file. Keeps references to all three.
    ObjMaterials(const std::filesystem::path& path, const MeshFileOptions& options, FileMesh& mesh);

    /// Adds the materials of a library. One that cannot be opened is a warning.
    void read_library(const std::string& file);
    /// The number of a material; 0 for the default, which a name that is not known gets.
    std::uint32_t use(std::string_view name);
    /// Colours the next face of the mesh. Null stands for corners without texture coordinates.
    void add_face(std::uint32_t material, std::span<const Texcoord* const> texcoords);
    /// Gives the warnings, once all faces have been added.
    void finish();

private:
    struct Used {
        Material material;
        std::uint32_t texture = kNoTexture;
    };
    std::uint32_t texture_of(const TextureMap& map);
    std::filesystem::path file_of(const TextureMap& map);

    const std::filesystem::path& path_;
    const MeshFileOptions& options_;
    FileMesh& mesh_;
    const std::string name_;
    std::set<std::filesystem::path> libraries_;
    MaterialMap materials_;
    std::vector<Used> used_ = {{}};
    std::unordered_map<std::string, std::uint32_t> numbers_;
    bool has_textured_faces_ = false;
    WarningCount unread_;
    WarningCount unknown_;
    WarningCount missing_;
    WarningCount without_texcoords_;
};

}  // namespace mray
