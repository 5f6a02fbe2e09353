// Nodes and skins of a glTF file.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "scenes/gltf/accessor.h"
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
/// ancestor, a matrix together with other transformations, numbers that are not a transformation,
/// and more nodes than the budget has memory for. Warns of a scene that lists nodes with parents.
NodeTree read_nodes(const GltfFile& file, const WarnFunction& warn);

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
