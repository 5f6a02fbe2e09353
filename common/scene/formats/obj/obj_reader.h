// An OBJ file as positions, faces and colours.
#pragma once

#include <filesystem>
#include <vector>

#include "common/base/warning_count.h"
#include "common/interop/platform.h"
#include "common/scene/mesh.h"
#include "common/scene/polygons/polygons.h"
#include "common/scene/textures.h"

namespace mray {

struct ObjOptions {
    /// Accept, with a warning each, coordinates that are not finite or beyond 1e30, files without
    /// vertices or faces, and leave out faces that cannot be read.
    bool lenient = false;
    /// Accept a file without faces, or without anything.
    bool allow_empty = false;
    /// Read the material libraries; otherwise every albedo is kDefaultAlbedo.
    bool materials = true;
    /// Read which corners share a normal.
    bool normals = false;
    /// Read texture coordinates and the textures of materials.
    bool textures = false;
    WarnFunction warn = {};
};

/// The faces of the file that have three corners or more, in their order.
struct ObjMesh {
    /// Each `v` of the file, in the file's units, correctly rounded to float.
    std::vector<vec3> positions;
    Polygons faces;
    /// One for each face.
    std::vector<Albedo> albedo;
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

/// Reads positions, faces and, from the material libraries beside the file, diffuse colours and
/// the names of textures; normals only for ObjMesh::smooth. A texture that is not there, or not in
/// the folder of its library, is a warning, and its faces have their colour alone; so do faces
/// without texture coordinates. Checks every token before
/// tinyobjloader parses the text. Leaves out faces of two corners with a warning; keeps degenerate
/// faces. Gives warnings only if it does not throw. Throws Error: kBadInput with file and line,
/// kLimit (4 GiB, 2^28 triangles). Thread-safe if each call has its own options.
ObjMesh read_obj(const std::filesystem::path& path, const ObjOptions& options = {});

}  // namespace mray
