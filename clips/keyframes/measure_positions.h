// Bounds of positions, and whether all are ordinary numbers, in one pass.
#pragma once

#include <cstddef>
#include <optional>
#include <span>

#include "common/interop/platform.h"
#include "common/scene/world_bounds.h"

namespace mray {

/// The first vertex with a coordinate that is not finite or beyond kMaxCoordinate.
struct BadCoordinate {
    std::size_t vertex = 0;
    float value = 0;
};

struct PositionMeasures {
    /// As bounds_of().
    WorldBounds bounds;
    std::optional<BadCoordinate> bad;
};

/// Takes about as long as reading the memory, unless a coordinate is bad.
PositionMeasures measure_positions(std::span<const vec3> positions);

}  // namespace mray
