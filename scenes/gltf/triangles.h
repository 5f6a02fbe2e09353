// Triangles of the modes of a glTF primitive.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "common/interop/platform.h"

namespace mray::gltf {

enum class TriangleMode : std::uint8_t { kTriangles = 4, kStrip = 5, kFan = 6 };

inline std::size_t count_triangles(TriangleMode mode, std::size_t corner_count) {
    return mode == TriangleMode::kTriangles ? corner_count / 3 : corner_count - 2;
}

/// The triangles of at least three corners, as the specification orders them (glTF 2.0, 3.7.2.1).
/// Without indices the corners are vertices 0, 1, 2, ...
inline std::vector<uvec3> triangles_of(TriangleMode mode, std::span<const std::uint32_t> indices,
                                       std::size_t corner_count) {
    const auto vertex = [&](std::size_t corner) {
        return indices.empty() ? static_cast<std::uint32_t>(corner) : indices[corner];
    };
    std::vector<uvec3> triangles(count_triangles(mode, corner_count));
    for (std::size_t i = 0; i < triangles.size(); ++i) {
        if (mode == TriangleMode::kTriangles) {
            triangles[i] = {vertex(3 * i), vertex(3 * i + 1), vertex(3 * i + 2)};
        } else if (mode == TriangleMode::kStrip) {
            triangles[i] = {vertex(i), vertex(i + 1 + i % 2), vertex(i + 2 - i % 2)};
        } else {
            triangles[i] = {vertex(i + 1), vertex(i + 2), vertex(0)};
        }
    }
    return triangles;
}

}  // namespace mray::gltf
