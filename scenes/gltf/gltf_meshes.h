// The meshes of a glTF file, with their materials and skins.
#pragma once

#include "common/scene/mesh.h"
#include "scenes/animation.h"
#include "scenes/gltf/gltf_file.h"
#include "scenes/gltf/transforms.h"
#include "scenes/mesh/mesh_file.h"

namespace mray::gltf {

/// The texture coordinates of a material: those of attribute TEXCOORD_`set`. Maps glTF's (u, v),
/// with v from the top, to (u[0] * u + u[1] * v + u[2], v[0] * u + v[1] * v + v[2]) of an image.
struct TexcoordUse {
    std::uint64_t set = 0;
    std::array<double, 3> u = {1, 0, 0};
    std::array<double, 3> v = {0, 1, 0};
};

struct Material {
    /// White where the file does not say.
    Albedo albedo = 0x00FFFFFF;
    /// An index of Materials::textures, or kNoTexture.
    std::uint32_t texture = kNoTexture;
    TexcoordUse texcoords = {};
    /// Whether its alpha mode MASK removes all of it, whatever the texture.
    bool is_cut_away = false;
};

struct Materials {
    std::vector<Material> materials;
    std::vector<TextureFile> textures;
};

/// Reads the base colour of every material. Textures that cannot be used are left out with a
/// warning.
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

/// Vertices that primitives of a mesh share.
struct VertexSet {
    std::vector<vec3> positions;
    /// The displacements of each morph target; empty for one that moves nothing.
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

}  // namespace mray::gltf
