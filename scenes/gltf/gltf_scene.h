// A glTF file as what is needed to pose it.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <vector>

#include "common/scene/mesh.h"
#include "common/scene/textures.h"
#include "scenes/clip.h"
#include "scenes/gltf/animation.h"
#include "scenes/gltf/meshes.h"
#include "scenes/gltf/nodes.h"

namespace mray::gltf {

/// A vertex set that a node places: vertices [first_vertex, first_vertex + its size) of the clip.
struct Part {
    std::uint32_t node = 0;
    const VertexSet* set = nullptr;
    /// A key of GltfScene::skins; nothing for a part that follows its node.
    std::optional<std::uint32_t> skin;
    std::uint32_t first_vertex = 0;
};

struct GltfScene {
    NodeTree tree;
    /// By their indices in the file, as far as nodes of the scene have them.
    std::map<std::uint32_t, Mesh> meshes;
    std::map<std::uint32_t, Skin> skins;
    Animation animation;
    /// As Clip::animations().
    std::vector<ClipAnimation> animations;
    /// In the order of the nodes, depth first, then of the primitives.
    std::vector<Part> parts;

    Topology topology;
    /// As Clip::smooth_corners(); empty if no primitive has normals.
    std::vector<uvec3> smooth;
    SceneTextures textures;
};

/// Reads the scene that options.animation moves. Throws Error: kBadInput with the place in the
/// JSON, kBadArgument for another animation, kLimit for a mesh above 2^28 triangles.
GltfScene read_gltf_scene(const std::filesystem::path& path, const ClipOptions& options);

}  // namespace mray::gltf
