// Vertices that a matrix moves, for devices that move them themselves.
#pragma once

#include <cmath>
#include <cstdint>
#include <span>

#include "common/interop/transform.h"
#include "common/scene/scene_space.h"

namespace mray {

/// Vertices first_vertex, ... lie at space.to_scene(transform_point(transform, rest[i])). None is
/// left out, and devices compute the same bits.
struct Body {
    std::uint32_t first_vertex = 0;
    std::span<const vec3> rest = {};
    /// Differs for other rest positions of the same scene.
    std::uint64_t rest_version = 0;
    Transform transform = {};
    SceneSpace space;

    std::uint32_t end_vertex() const {
        return first_vertex + static_cast<std::uint32_t>(rest.size());
    }
};

/// True if devices, which may flush denormals, move points of 0 and normal floats to the positions
/// of the host (docs/design/arithmetic.md, "Bodies").
inline bool moves_alike_on_devices(const Transform& transform, const SceneSpace& space) {
    if (space.exponent() < -126 || space.exponent() > 33) return false;
    for (int axis = 0; axis < 3; ++axis)
        if (space.centre(axis) != 0 && std::abs(space.centre(axis)) < 0x1p-49) return false;
    for (const vec4& row : {transform.x, transform.y, transform.z}) {
        for (const float m : {row.x, row.y, row.z})
            if (m != 0 && !std::isnormal(m)) return false;
        if (row.w != 0 && std::abs(row.w) < 0x1p-49f) return false;
    }
    return true;
}

}  // namespace mray
