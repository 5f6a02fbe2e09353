// A PLY file as positions, faces and colours.
#pragma once

#include <filesystem>

#include "scenes/mesh/file_mesh.h"

namespace mray {

/// Reads a PLY file (Greg Turk, "The PLY Polygon File Format", 1994), in text or binary with either
/// order of bytes: of the element `vertex` the positions x y z, the colours red green blue and the
/// normals nx ny nz, the latter for FileMesh::smooth alone; of `face` the list vertex_indices or
/// vertex_index; of `tristrips` the same list, in which -1 ends a strip. Skips all others. Faults
/// of coordinates and faces are those of OBJ files (MeshRules).
///
/// Colours of type uchar are those of images, whose squares are linear; others are linear.
/// Normals tell which corners are smooth together: those of vertices with equal positions and
/// normals.
///
/// Checks the numbers of the header against the size of the file before it takes memory for them.
/// Gives warnings only if it does not throw. Throws Error: kBadInput with the file and the line, or
/// the byte of a binary file; kLimit (4 GiB, 2^28 triangles). Thread-safe if each call has its own
/// options.
FileMesh read_ply(const std::filesystem::path& path, const MeshFileOptions& options = {});

}  // namespace mray
