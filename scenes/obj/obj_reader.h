// An OBJ file as positions, faces and colours.
#pragma once

#include <filesystem>

#include "scenes/mesh/file_mesh.h"

namespace mray {

/// A longer line is not OBJ text. Faces are exempt: a polygon of 200,000 corners is one line of
/// 1.3 MB.
inline constexpr std::size_t kMaxObjLineBytes = std::size_t{1} << 20;

/// Reads positions, faces and, from the material libraries beside the file, diffuse colours and
/// the names of textures; normals only for FileMesh::smooth. A texture that is not there, or not in
/// the folder of its library, is a warning, and its faces have their colour alone; so do faces
/// without texture coordinates. Checks the words of faces
/// before tinyobjloader parses them. Leaves out faces of two corners with a warning; keeps
/// degenerate faces. Gives warnings only if it does not throw. Throws Error: kBadInput with file
/// and line, kLimit (4 GiB, 2^28 triangles). Thread-safe if each call has its own options.
FileMesh read_obj(const std::filesystem::path& path, const MeshFileOptions& options = {});

}  // namespace mray
