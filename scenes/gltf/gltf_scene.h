// A glTF scene: its nodes, its animation, and the meshes that nodes place.
#pragma once

#include <filesystem>

#include "scenes/gltf/gltf_meshes.h"

namespace mray::gltf {

inline constexpr std::uint32_t kNoNode = 0xFFFFFFFFu;

struct Node {
    std::uint32_t parent = kNoNode;
    std::vector<std::uint32_t> children;
    /// Maps to the parent's space; replaced by `matrix` if there is one.
    Trs trs;
    std::optional<Affine> matrix;
    std::optional<std::uint32_t> mesh;
    std::optional<std::uint32_t> skin;
    /// Weights of morph targets; empty: the mesh's weights.
    std::vector<double> weights;

    /// The map to the parent's space while nothing moves the node.
    Affine rest() const { return matrix ? *matrix : affine_of(trs); }
};

struct NodeTree {
    std::vector<Node> nodes;
    /// Parents before their children; all nodes of the file.
    std::vector<std::uint32_t> parents_first;
    /// The nodes of the default scene, of scene 0, or without scenes of all roots; depth first.
    std::vector<std::uint32_t> scene;
};

enum class Interpolation : std::uint8_t { kStep, kLinear, kCubicSpline };
enum class Target : std::uint8_t { kTranslation, kRotation, kScale, kWeights };

/// The in-tangent, value and out-tangent of a cubic spline's key.
inline constexpr std::size_t kSplineValues = 3;

struct Channel {
    std::uint32_t node = 0;
    Target target = Target::kTranslation;
    Interpolation interpolation = Interpolation::kLinear;
    /// Numbers a value: 3, 4, or the number of morph targets.
    std::size_t width = 3;
    /// Seconds; they increase.
    std::span<const float> times = {};
    /// `width` numbers for each time; of a cubic spline in-tangent, value and out-tangent.
    std::span<const float> values = {};
};

/// Values of all channels; rotations have directions.
struct ChannelSet {
    std::vector<Channel> channels;
    /// The last time of any channel.
    double seconds = 0;

    /// By the index of the accessor, and the numbers an element has.
    std::map<std::pair<std::uint32_t, std::size_t>, std::vector<float>> numbers = {};
};

/// A vertex set as a node places it: vertices of the animation from first_vertex on.
struct PlacedSet {
    std::uint32_t node = 0;
    const VertexSet* set = nullptr;
    /// A key of GltfScene::skins; nothing for a set that follows its node.
    std::optional<std::uint32_t> skin;
    std::uint32_t first_vertex = 0;
};

struct GltfScene {
    NodeTree tree;
    /// By their indices in the file, as far as nodes of the scene have them.
    std::map<std::uint32_t, Mesh> meshes;
    std::map<std::uint32_t, Skin> skins;
    ChannelSet animation;
    std::vector<NamedAnimation> animations;
    /// In the order of the nodes, depth first, then of the primitives.
    std::vector<PlacedSet> placed_sets;

    Topology topology;
    /// As Animation::smooth_corners(); empty if no primitive has normals.
    std::vector<uvec3> smooth;
    SceneTextures textures;
};

/// Reads the scene that options.animation moves. Throws Error: kBadInput with the place in the
/// JSON, kBadArgument for another animation, kLimit.
GltfScene read_gltf_scene(const std::filesystem::path& path, const AnimationOptions& options);

}  // namespace mray::gltf
