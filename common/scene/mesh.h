// The constant part of a triangle scene.
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

/// The most triangles of a scene: more might need a tree that is too high
/// (common/bvh/builder/binary_tree.h).
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
    std::uint64_t not_finite = 0;
    std::uint64_t zero_area = 0;
};
DegenerateCount count_degenerate(const Topology& topology, std::span<const vec3> positions);

/// Returns true if a triangle in scene space has an area, exactly, and its vertices are finite.
bool has_area(vec3 a, vec3 b, vec3 c);

}  // namespace mray
