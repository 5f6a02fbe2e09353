// The meshes of a file that assimp has read, as one mesh.
#pragma once

#include <string>

#include "scenes/mesh/file_mesh.h"

struct aiScene;

namespace mray::app {

/// Puts the triangles and polygons of all meshes together, in the order of the nodes, each parent
/// before its children and a mesh as often as nodes have it, with the nodes' transformations.
/// Vertices of one position are one, bit for bit: assimp splits them. Lines and points are left
/// out. The albedo of a face is the diffuse colour of its material, linear. Coordinates and faces
/// obey the rules of all mesh files. `name` is the file in messages.
///
/// Throws Error: kBadInput for indices that are not there; kLimit (2^28 triangles; 2^20 nodes).
FileMesh mesh_of(const aiScene& scene, const std::string& name, const MeshFileOptions& options);

}  // namespace mray::app
