#include "common/scene/world_bounds.h"

#include <algorithm>
#include <cmath>

namespace mray {

void WorldBounds::extend(const double other_lower[3], const double other_upper[3]) {
    const bool was_empty = empty();
    for (int axis = 0; axis < 3; ++axis) {
        lower[axis] = was_empty ? other_lower[axis] : std::min(lower[axis], other_lower[axis]);
        upper[axis] = was_empty ? other_upper[axis] : std::max(upper[axis], other_upper[axis]);
    }
}

WorldBounds bounds_of(std::span<const vec3> points) {
    WorldBounds bounds;
    for (const vec3 p : points) {
        if (!std::isfinite(p.x) || !std::isfinite(p.y) || !std::isfinite(p.z)) continue;
        const double point[3] = {p.x, p.y, p.z};
        bounds.extend(point, point);
    }
    return bounds;
}

}  // namespace mray
