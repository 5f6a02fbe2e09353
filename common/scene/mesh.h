// The constant part of a triangle scene, and what its triangles are like.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "common/interop/platform.h"

namespace mray {

/// An albedo of 8 bits a channel, linear: R in bits 0-7, G in 8-15, B in 16-23.
using Albedo = std::uint32_t;
inline constexpr Albedo kDefaultAlbedo = 0x00BFBFBF;

/// The albedo of linear channels, clamped to [0, 1] and rounded to 8 bits.
Albedo albedo_of(float r, float g, float b);

/// The most triangles of a scene: more might need a tree above kMaxBinaryHeight.
inline constexpr std::uint64_t kMaxTriangles = std::uint64_t{1} << 28;

/// The constant part of a deforming scene. prim_id i is triangles[i]; every index is below
/// vertex_count; albedo has one entry for each triangle.
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

/// Returns true if a triangle in scene space has an area, exactly, and its vertices are finite.
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

/// A list of one range with all indices.
inline constexpr IndexRange kAllIndices[1] = {{0, 0xFFFFFFFFu}};

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

}  // namespace mray
