// The meshes of a glTF file.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <vector>

#include "common/interop/platform.h"
#include "common/scene/textures.h"
#include "scenes/clip_options.h"
#include "scenes/gltf/accessor.h"
#include "scenes/warning_count.h"

namespace mray::gltf {

/// The deltas that a morph target adds to positions.
struct MorphTarget {
    /// The vertices that it moves, in increasing order; empty: as many as there are deltas, from 0.
    std::vector<std::uint32_t> vertices;
    std::vector<vec3> deltas;
};

/// Joints of a skin that move a vertex: `per_vertex` entries each, of which those that are not
/// needed have weight 0. The sum of the weights of a vertex is above 0, not always 1.
struct Influences {
    std::size_t per_vertex = 0;
    std::vector<std::uint16_t> joints;
    std::vector<float> weights;
    /// Above all joints.
    std::uint32_t joint_limit = 0;
};

/// Vertices that primitives of a mesh have in common.
struct VertexSet {
    std::vector<vec3> positions;
    std::vector<MorphTarget> targets;
    Influences influences;
};

struct Primitive {
    std::size_t vertex_set = 0;
    /// Indices of vertices of the set.
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

/// For each material; nothing for one without a texture.
using TexcoordUses = std::vector<std::optional<TexcoordUse>>;

/// Reads one mesh after the other. Primitives of points and lines and those without positions are
/// left out with a warning.
class MeshReader {
public:
    /// Keeps the references.
    MeshReader(const GltfFile& file, Accessors& accessors, const TexcoordUses& texcoord_uses,
               const ClipOptions& options);

    /// Throws Error(kBadInput) for indices and counts that do not fit together, weights that are
    /// negative, not finite or all 0 (if lenient, a warning and the first joint), and positions
    /// that are not finite or beyond 1e30 (if lenient, a warning); kLimit above 2^28 triangles.
    Mesh read(std::size_t index);
    /// Gives the warnings, once all meshes have been read.
    void finish() const;

private:
    /// The accessors that make a vertex set: primitives with the same ones share it.
    struct SetKey;
    void read_primitive(const JsonAt& at, Mesh& mesh, std::map<SetKey, std::size_t>& sets);
    VertexSet read_set(const JsonAt& at);
    void check_positions(const JsonAt& at, const std::vector<vec3>& positions);
    MorphTarget read_target(const JsonAt& at, std::size_t vertex_count);
    Influences read_influences(const JsonAt& attributes, std::size_t vertex_count);
    std::vector<uvec3> read_triangles(const JsonAt& at, std::uint64_t mode,
                                      std::size_t vertex_count);
    std::vector<vec3> read_normals(const JsonAt& attributes, std::size_t vertex_count);
    std::vector<Texcoord> read_texcoords(const JsonAt& attributes, const Primitive& primitive,
                                         std::size_t vertex_count);
    std::vector<vec3> read_vectors(const JsonAt& reference, const char* what,
                                   std::size_t vertex_count);
    Wanted::Integers quantized(Wanted::Integers otherwise) const;

    const GltfFile& file_;
    Accessors& accessors_;
    const TexcoordUses& texcoord_uses_;
    const ClipOptions& options_;
    bool is_quantized_;
    std::uint64_t triangle_count_ = 0;
    WarningCount left_out_;
    WarningCount not_finite_;
    WarningCount unweighted_;
    WarningCount without_texcoords_;
};

}  // namespace mray::gltf
