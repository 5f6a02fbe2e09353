// Helpers of the tests of built-in scenes.
#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "tests/support/animation_positions.h"

namespace mray {

/// Directed edges that do not have exactly one opposite, or occur more than once.
inline std::size_t open_edges(std::span<const uvec3> triangles) {
    std::map<std::pair<std::uint32_t, std::uint32_t>, int> count;
    for (const uvec3& t : triangles) {
        for (int i = 0; i < 3; ++i) ++count[{t[i], t[(i + 1) % 3]}];
    }
    std::size_t open = 0;
    for (const auto& [edge, n] : count) {
        const auto opposite = count.find({edge.second, edge.first});
        if (n != 1 || opposite == count.end() || opposite->second != 1) ++open;
    }
    return open;
}

/// Six times the volume of the tetrahedron (origin, a, b, c), positive if a, b, c turn
/// counter-clockwise seen from outside.
inline long double volume6(vec3 a, vec3 b, vec3 c) {
    const auto wide = [](float x) { return static_cast<long double>(x); };
    return wide(a.x) * (wide(b.y) * c.z - wide(b.z) * c.y) +
           wide(a.y) * (wide(b.z) * c.x - wide(b.x) * c.z) +
           wide(a.z) * (wide(b.x) * c.y - wide(b.y) * c.x);
}

/// Six times the volume that a closed mesh encloses: positive if its triangles face outwards.
inline long double mesh_volume6(std::span<const uvec3> triangles, std::span<const vec3> positions) {
    long double volume = 0;
    for (const uvec3& t : triangles) {
        volume += volume6(positions[t.x], positions[t.y], positions[t.z]);
    }
    return volume;
}

}  // namespace mray
