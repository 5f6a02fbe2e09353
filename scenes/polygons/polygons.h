// Faces of any number of corners.
#pragma once

#include <cstdint>
#include <vector>

#include "common/scene/mesh.h"

namespace mray {

/// Face i has corner_counts[i] >= 3 corners; all corners follow one another in `corners`.
struct Polygons {
    std::vector<std::uint32_t> corners;
    std::vector<std::uint32_t> corner_counts;
    bool operator==(const Polygons&) const = default;
};

}  // namespace mray
