// Point caches: PC2 files (Autodesk 3ds Max, Blender), the positions of a mesh file's vertices.
#pragma once

#include <filesystem>

#include "scenes/animation.h"

namespace mray {

/// Each sample of a point cache is a keyframe. Throws Error(kBadInput), also for another number of
/// points than the mesh has vertices.
std::unique_ptr<Animation> open_cached(const std::filesystem::path& mesh,
                                       const std::filesystem::path& cache, const std::string& name,
                                       const AnimationOptions& options);

}  // namespace mray
