// Skins of a glTF file, and the joints that move the vertices of its meshes.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "scenes/gltf/accessor.h"
#include "scenes/gltf/transforms.h"
#include "scenes/warning_count.h"

namespace mray::gltf {

struct Skin {
    /// Indices of nodes, at least one.
    std::vector<std::uint32_t> joints;
    /// For each joint the map from the mesh to the joint's space.
    std::vector<Affine> inverse_binds;
};

/// Throws Error(kBadInput) for a skin without joints or with more than 65536, and for fewer or
/// other matrices than joints.
Skin read_skin(const GltfFile& file, std::size_t index);

/// Joints of a skin that move a vertex: `per_vertex` entries each, of which those that are not
/// needed have weight 0. The sum of the weights of a vertex is above 0, not always 1.
struct Influences {
    std::size_t per_vertex = 0;
    std::vector<std::uint16_t> joints;
    std::vector<float> weights;
    /// Above all joints.
    std::uint32_t joint_limit = 0;
};

/// Reads attributes JOINTS_n and WEIGHTS_n of a primitive. A vertex without a weight above 0 is an
/// error; if lenient, it moves with its first joint, with a warning.
Influences read_influences(const GltfFile& file, const JsonAt& attributes, std::size_t vertex_count,
                           bool lenient, WarningCount& unweighted);

/// Throws Error(kBadInput) unless an accessor has an element for each vertex of its primitive.
void require_count(const Accessor& accessor, std::size_t vertex_count);

}  // namespace mray::gltf
