// Triangles that no ray can hit.
#pragma once

#include <cstdint>
#include <span>

#include "common/scene/mesh.h"

namespace mray {

/// Triangles that no ray can hit at these positions (scene space).
struct DegenerateCount {
    std::uint64_t not_finite = 0;
    std::uint64_t zero_area = 0;
};
DegenerateCount count_degenerate(const Topology& topology, std::span<const vec3> positions);

}  // namespace mray
