// Formats of meshes that a build has or has not.
#pragma once

#include <span>

#include "scenes/mesh/file_mesh.h"

namespace mray::app {

/// The formats that assimp reads for this build; none if it was built without.
std::span<const MeshFormat> optional_mesh_formats();

}  // namespace mray::app
