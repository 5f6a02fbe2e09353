// A glTF file as what is needed to pose it, and how its parts are read.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <tuple>
#include <vector>

#include "common/interop/platform.h"
#include "common/scene/mesh.h"
#include "common/scene/textures.h"
#include "scenes/animation.h"
#include "scenes/gltf/gltf_file.h"
#include "scenes/gltf/transforms.h"
#include "scenes/mesh/mesh_rules.h"

namespace mray::gltf {

inline constexpr std::uint32_t kNoNode = 0xFFFFFFFFu;

struct Node {
    /// Its index in the file. Instances of a node's mesh are nodes below it with the same one.
    std::uint32_t file_index = 0;
    std::uint32_t parent = kNoNode;
    std::vector<std::uint32_t> children;
    /// The map to the parent's space is `matrix` if there is one, otherwise `trs`.
    Trs trs;
    std::optional<Affine> matrix;
    std::optional<std::uint32_t> mesh;
    /// Whether nodes below it show the mesh in its place.
    bool has_instances = false;
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

/// The nodes of the file, and after them one for each instance of EXT_mesh_gpu_instancing. Throws
/// Error(kBadInput), also for a node with two parents or one that is its own ancestor.
NodeTree read_nodes(const GltfFile& file);

/// A point of an image, glTF's (u, v) with v from the top, is (u[0] * u + u[1] * v + u[2], v[0] * u
/// + v[1] * v + v[2]).
struct TexcoordMap {
    std::array<double, 3> u = {1, 0, 0};
    std::array<double, 3> v = {0, 1, 0};
    bool operator==(const TexcoordMap&) const = default;
};

/// The texture coordinates that a material wants: attribute TEXCOORD_n, and where it maps them.
struct TexcoordUse {
    std::uint32_t set = 0;
    TexcoordMap map = {};
};

struct Material {
    /// White where the file does not say.
    Albedo albedo = 0x00FFFFFF;
    /// An index of Materials::textures, or kNoTexture.
    std::uint32_t texture = kNoTexture;
    TexcoordUse texcoords = {};
    /// Whether its alpha mode MASK leaves nothing, whatever the texture.
    bool is_cut_away = false;
};

struct Materials {
    std::vector<Material> materials;
    std::vector<TextureFile> textures;
};

/// Reads the base colour of every material. What cannot be used is left out with a warning.
Materials read_materials(const GltfFile& file, const AnimationOptions& options);

struct Skin {
    /// Indices of nodes, at least one.
    std::vector<std::uint32_t> joints;
    /// For each joint the map from the mesh to the joint's space.
    std::vector<Affine> inverse_binds;
};

/// Throws Error(kBadInput) unless it has 1 to 65536 joints, each with its matrix.
Skin read_skin(const GltfFile& file, std::size_t index);

/// `per_vertex` joints a vertex, unused ones with weight 0. Sums are above 0, not always 1.
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

/// Vertices that primitives of a mesh have in common.
struct VertexSet {
    std::vector<vec3> positions;
    /// What each morph target adds to them; empty for one that moves nothing.
    std::vector<std::vector<vec3>> targets;
    Influences influences;
};

struct Primitive {
    std::size_t vertex_set = 0;
    std::vector<uvec3> triangles;
    std::optional<std::uint32_t> material;
    /// One for each vertex, or empty.
    std::vector<vec3> normals;
    std::vector<Texcoord> texcoords;
};

struct Mesh {
    std::vector<VertexSet> sets;
    std::vector<Primitive> primitives;
    /// The number of morph targets, and their weights where a node has none.
    std::size_t target_count = 0;
    std::vector<double> weights;
};

/// The meshes with these indices. Points, lines and primitives without positions are left out with
/// a warning. Throws Error: kBadInput, kLimit above 2^28 triangles.
std::map<std::uint32_t, Mesh> read_meshes(const GltfFile& file, const Materials& materials,
                                          std::span<const std::uint32_t> indices,
                                          const AnimationOptions& options);

enum class Interpolation : std::uint8_t { kStep, kLinear, kCubicSpline };
enum class Target : std::uint8_t { kTranslation, kRotation, kScale, kWeights };

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

    /// By the index of the accessor, the numbers an element has, and whether it may have integers.
    std::map<std::tuple<std::uint32_t, std::size_t, bool>, std::vector<float>> numbers = {};
};

/// The animation of this name or index, or the first. Throws Error(kBadArgument) with the names.
std::size_t find_animation(const GltfFile& file, const std::string& text);

/// The names of all animations of a file, empty where it gives none.
std::vector<std::string> animation_names(const GltfFile& file);

/// The value of a channel at a time in seconds; a rotation has length 1.
void sample(const Channel& channel, double time, std::span<double> out);

/// Vertices [first_vertex, first_vertex + its size) of the animation, which a node places.
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
    ChannelSet animation;
    std::vector<NamedAnimation> animations;
    /// In the order of the nodes, depth first, then of the primitives.
    std::vector<Part> parts;

    Topology topology;
    /// As Animation::smooth_corners(); empty if no primitive has normals.
    std::vector<uvec3> smooth;
    SceneTextures textures;
};

/// Reads the animation of the nodes and meshes of a scene into it. Throws Error(kBadInput).
void read_animation(const GltfFile& file, std::size_t index, const AnimationOptions& options,
                    GltfScene& scene);

/// Reads the scene that options.animation moves. Throws Error: kBadInput with the place in the
/// JSON, kBadArgument for another animation, kLimit.
GltfScene read_gltf_scene(const std::filesystem::path& path, const AnimationOptions& options);

}  // namespace mray::gltf
