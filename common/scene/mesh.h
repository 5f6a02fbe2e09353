// The constant part of a triangle scene with its textures, and what its triangles are like.
#pragma once

#include <array>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "common/interop/platform.h"

namespace mray {

/// An albedo of 8 bits a channel, linear: R in bits 0-7, G in 8-15, B in 16-23.
using Albedo = std::uint32_t;
inline constexpr Albedo kDefaultAlbedo = 0x00BFBFBF;

/// Linear channels, clamped to [0, 1] and rounded.
Albedo albedo_of(float r, float g, float b);

/// The most triangles of a scene: more might need a tree above kMaxBinaryHeight.
inline constexpr std::uint64_t kMaxTriangles = std::uint64_t{1} << 28;

/// prim_id i is triangles[i], whose indices are below vertex_count, with albedo[i].
struct Topology {
    std::vector<uvec3> triangles;
    std::vector<Albedo> albedo;
    std::uint32_t vertex_count = 0;
};

/// XXH3 (64 bits) of the vertex count and the index list: equal for frames of one animation.
std::uint64_t topology_hash(const Topology& topology);

/// Triangles that no ray can hit at these positions (scene space).
struct DegenerateCount {
    /// With a vertex that is not finite, or left out (PoseExtent).
    std::uint64_t left_out = 0;
    std::uint64_t zero_area = 0;
};
DegenerateCount count_degenerate(const Topology& topology, std::span<const vec3> positions);

/// Exact, for a triangle in scene space; false if a vertex is not finite.
bool has_area(vec3 a, vec3 b, vec3 c);

/// Indices [begin, end).
struct IndexRange {
    std::uint32_t begin = 0;
    std::uint32_t end = 0;
    bool operator==(const IndexRange&) const = default;
};

/// The vertices that triangles use, as ascending ranges. `triangles` are indices below the count.
std::vector<IndexRange> used_vertices(std::span<const uvec3> triangles, std::size_t vertex_count);
inline std::vector<IndexRange> used_vertices(const Topology& topology) {
    return used_vertices(topology.triangles, topology.vertex_count);
}

/// The number of triangles with a vertex that is not finite.
std::uint64_t count_not_finite(const Topology& topology, std::span<const vec3> positions);

/// The edges where a surface is not that of a solid. Each edge is counted once.
struct EdgeCounts {
    /// Edges of one triangle.
    std::uint64_t open = 0;
    /// Edges of more than two triangles.
    std::uint64_t shared = 0;
    /// Edges of two triangles that both run through them in one direction.
    std::uint64_t turned = 0;
    /// Edges that triangles run through more often in one direction than in the other: all open and
    /// turned ones, and some shared ones. The surface is closed if there are none.
    std::uint64_t uneven = 0;
    /// Triangles of which another one has the same places in the opposite direction.
    std::uint64_t twins = 0;
};

/// Counts the edges of all triangles at these positions (scene space). Vertices at one place are
/// one vertex. Triangles with a corner that is not finite, or with two corners at one place, do not
/// count. O(n log n).
EdgeCounts count_edges(const Topology& topology, std::span<const vec3> positions);

/// "4 open, 0 of more than two triangles, 1 turned", or "closed: 0 open, ...", and any twins.
std::string describe(const EdgeCounts& counts);

// ---- Textures: which images triangles show, and where on them

/// Stands for the number of a texture of a triangle that has none.
inline constexpr std::uint32_t kNoTexture = 0xFFFFFFFFu;

/// A point of an image: u from its left side (0) to the right (1), v from below (0) to the top (1).
struct Texcoord {
    float u = 0;
    float v = 0;
    bool operator==(const Texcoord&) const = default;
};

using Texcoords = std::array<Texcoord, 3>;

/// An image file, and whether its border pixels go on outside of it; otherwise it repeats.
struct TextureFile {
    std::string path = {};
    bool clamp = false;
    /// From 0 to 1: where its alpha is below this, it has holes. 0: nowhere.
    float alpha_cutoff = 0;
    /// The part of the file that is the image, in bytes; size 0: all of it.
    std::uint64_t offset = 0;
    std::uint64_t size = 0;
    /// Where in the file at `path` the image stands, for messages, such as "images[3]"; empty: it
    /// is the file.
    std::string place = {};
    /// Bytes that stand in the file in base 64, of which the image is a part; null: the file's.
    std::shared_ptr<const std::string> content = {};
    bool operator==(const TextureFile&) const = default;
};

/// The textures of a mesh, the same in all frames. A triangle's colour is the product of its albedo
/// and its texture. Without files all are empty, else the others have an entry for each triangle.
struct SceneTextures {
    std::vector<TextureFile> files;
    std::vector<Texcoords> texcoords;
    std::vector<std::uint32_t> texture_ids;
};

}  // namespace mray
