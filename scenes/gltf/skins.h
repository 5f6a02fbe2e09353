// The skins of a glTF file.
#pragma once

#include <cstdint>
#include <vector>

#include "scenes/gltf/file/accessor.h"
#include "scenes/gltf/motion/affine.h"

namespace mray::gltf {

struct Skin {
    /// Indices of nodes, at least one.
    std::vector<std::uint32_t> joints;
    /// For each joint the map from the mesh to the joint's space.
    std::vector<Affine> inverse_binds;
};

/// Throws Error(kBadInput) for a skin without joints or with more than 65536, and for fewer or
/// other matrices than joints.
Skin read_skin(const GltfFile& file, Accessors& accessors, std::size_t index);

}  // namespace mray::gltf
