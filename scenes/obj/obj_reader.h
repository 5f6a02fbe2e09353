// Reads OBJ files, and MTL libraries of materials.
#pragma once

#include <filesystem>

#include "scenes/mesh/mesh_file.h"

namespace mray {

/// Reads positions and colours of vertices, faces, normals for FileMesh::smooth alone, and from
/// material libraries diffuse colours and the names of textures. Faces whose texture is missing
/// have their colour alone, with a warning. Keeps degenerate faces. Throws Error: kBadInput with
/// file and line, kLimit (4 GiB, 2^28 triangles). Thread-safe if each call has its options.
FileMesh read_obj(const std::filesystem::path& path, const MeshFileOptions& options = {});

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

/// The materials of an MTL text by their names, the first of a name. `unread` counts colours that
/// are not read, or not as they are. Throws Error(kBadInput) for binary data.
MaterialMap read_mtl_text(std::string_view text, const std::filesystem::path& library,
                          WarningCount& unread);

}  // namespace mray
