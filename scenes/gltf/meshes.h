// The meshes of a glTF file.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <vector>

#include "common/interop/platform.h"
#include "scenes/gltf/materials.h"
#include "scenes/gltf/skins.h"

namespace mray::gltf {

/// The deltas that a morph target adds to positions.
struct MorphTarget {
    /// The vertices that it moves, in increasing order; empty: as many as there are deltas, from 0.
    std::vector<std::uint32_t> vertices;
    std::vector<vec3> deltas;
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

/// The meshes with these indices. Primitives of points and lines and those without positions are
/// left out with a warning.
///
/// Throws Error(kBadInput) for indices and counts that do not fit together, weights that are
/// negative, not finite or all 0 (if lenient, a warning and the first joint), and positions that
/// are not finite or beyond 1e30 (if lenient, a warning); kLimit above 2^28 triangles.
std::map<std::uint32_t, Mesh> read_meshes(const GltfFile& file, const Materials& materials,
                                          std::span<const std::uint32_t> indices,
                                          const ClipOptions& options);

}  // namespace mray::gltf
