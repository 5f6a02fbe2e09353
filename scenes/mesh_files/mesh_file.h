// Reads a mesh from a file of any format that is known.
#pragma once

#include <filesystem>
#include <span>
#include <string>

#include "scenes/mesh/file_mesh.h"

namespace mray {

/// The formats that every build reads.
std::span<const MeshFormat> mesh_formats();

/// The format whose extension the name has, in letters of either case; null if there is none.
const MeshFormat* mesh_format_of(const std::filesystem::path& path,
                                 std::span<const MeshFormat> more_formats);

/// The extensions of all formats for messages: ".obj or .ply".
std::string extensions_of_meshes(std::span<const MeshFormat> more_formats);

/// Reads a file in the format of its name; a name of no format is read as OBJ. Throws what
/// MeshFormat::read throws.
FileMesh read_mesh_file(const std::filesystem::path& path, const MeshFileOptions& options);

}  // namespace mray
