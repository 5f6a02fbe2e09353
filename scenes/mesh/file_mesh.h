// A mesh as a file has it, whatever its format.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string_view>
#include <vector>

#include "common/interop/platform.h"
#include "common/scene/mesh.h"
#include "common/scene/textures.h"
#include "scenes/polygons/polygons.h"
#include "scenes/warning_count.h"

namespace mray {

struct FileMesh;
struct MeshFileOptions;

/// A format of files with one mesh each.
struct MeshFormat {
    std::string_view name;
    /// With its dot, in lower case.
    std::string_view extension;
    /// The things that are read from a file, in words.
    std::string_view content;
    /// Throws Error: kBadInput with the file and the place in it, kLimit.
    FileMesh (*read)(const std::filesystem::path& path, const MeshFileOptions& options);
};

struct MeshFileOptions {
    /// Accept coordinates that are not finite or beyond 1e30 and leave out faces that cannot be
    /// read, with a warning each.
    bool lenient = false;
    /// Accept a file without faces, or without anything.
    bool allow_empty = false;
    /// Read colours and material libraries; otherwise every albedo is kDefaultAlbedo.
    bool materials = true;
    /// Read which corners share a normal.
    bool normals = false;
    /// Read texture coordinates and the textures of materials.
    bool textures = false;
    /// Formats beyond mesh_formats().
    std::span<const MeshFormat> more_formats = {};
    WarnFunction warn = {};
};

/// The faces of the file that have three corners or more, in their order.
struct FileMesh {
    /// Each vertex of the file, in the file's units, correctly rounded to float.
    std::vector<vec3> positions;
    Polygons faces;
    /// One for each face; empty: kDefaultAlbedo for all.
    std::vector<Albedo> albedo;
    /// Linear colours of the vertices, finite; a triangle has the mean of its three. Empty: none.
    /// If there are any, `albedo` is empty.
    std::vector<vec3> vertex_colours;
    /// For each corner of `faces` a number, below that of all corners: corners of one position with
    /// equal normals have the same number, those without a normal a number of their own. Empty if
    /// the file has no normals, or they are not read.
    std::vector<std::uint32_t> smooth;
    /// The textures that faces use. Empty if there are none, or they are not read; then the arrays
    /// below are empty, too.
    std::vector<TextureFile> textures;
    /// For each face an index of `textures`, or kNoTexture.
    std::vector<std::uint32_t> face_textures;
    /// For each corner of `faces`; 0 where a face has no texture.
    std::vector<Texcoord> texcoords;
};

}  // namespace mray
