// Reads PLY files.
#pragma once

#include <filesystem>

#include "scenes/mesh/mesh_file.h"

namespace mray {

/// Reads the faces of a PLY file (Greg Turk, "The PLY Polygon File Format", 1994), in text, with a
/// line for each item, or binary with either order of bytes. The squares of integer colours are
/// linear, as in images; other colours are linear. Vertices with equal positions and normals are
/// smooth together. Throws Error: kBadInput with the line or the byte, kLimit. Thread-safe as
/// read_obj().
FileMesh read_ply(const std::filesystem::path& path, const MeshFileOptions& options = {});

}  // namespace mray
