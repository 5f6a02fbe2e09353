// The mesh that gives a clip its triangles.
#pragma once

#include <filesystem>
#include <vector>

#include "common/scene/mesh.h"
#include "common/scene/textures.h"
#include "scenes/clip_options.h"
#include "scenes/polygons/polygons.h"

namespace mray {

struct FirstMesh {
    Topology topology;
    /// As Clip::smooth_corners(), but empty if the file has no normals.
    std::vector<uvec3> smooth;
    SceneTextures textures;
    /// The faces that the triangles were made of.
    Polygons faces;
    std::vector<vec3> positions;
};

/// Reads a mesh file. Throws Error(kBadInput).
FirstMesh read_first_mesh(const std::filesystem::path& path, const ClipOptions& options);

}  // namespace mray
