// Nodes and skins of a glTF file.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "scenes/gltf/gltf_file.h"
#include "scenes/gltf/transforms.h"

namespace mray::gltf {

inline constexpr std::uint32_t kNoNode = 0xFFFFFFFFu;

struct Node {
    std::uint32_t parent = kNoNode;
    std::vector<std::uint32_t> children;
    /// The map to the parent's space is `matrix` if there is one, otherwise `trs`.
    Trs trs;
    std::optional<Affine> matrix;
    std::optional<std::uint32_t> mesh;
    std::optional<std::uint32_t> skin;
    /// Weights of the morph targets of the mesh; empty: those of the mesh.
    std::vector<double> weights;
};

struct NodeTree {
    std::vector<Node> nodes;
    /// Parents before their children; all nodes of the file.
    std::vector<std::uint32_t> parents_first;
    /// The nodes of the scene, depth first: the default scene, or scene 0, or without scenes all
    /// roots in their order. Each is there once, also if the scene lists nodes below others that it
    /// lists; a node's parents need not be there.
    std::vector<std::uint32_t> scene;
};

/// Throws Error(kBadInput) for indices out of range, a node with two parents, one that is its own
/// ancestor, a matrix together with other transformations, and numbers that are not one.
NodeTree read_nodes(const GltfFile& file);

}  // namespace mray::gltf
