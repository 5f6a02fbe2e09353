// Where the nodes of a glTF scene are at a time.
#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <vector>

#include "scenes/gltf/gltf_scene.h"

namespace mray::gltf {

struct Pose {
    /// From the space of each node to world space.
    std::vector<Affine> to_world;
    /// weights[part][target]: one for each part of the scene and each morph target of its mesh.
    std::vector<std::vector<double>> weights;
};

/// `seconds` before the first and after the last key are those keys. A pure function: the bits do
/// not depend on machine, threads or earlier calls.
Pose pose_at(const GltfScene& scene, double seconds);

}  // namespace mray::gltf
