// Axis-aligned boxes in scene space.
#pragma once

#include "common/interop/constants.h"
#include "common/interop/slab.h"

namespace mray {

/// Empty by default: inverted, the neutral element of `extend`.
struct Box {
    vec3 lower = {kEmptyPlane, kEmptyPlane, kEmptyPlane};
    vec3 upper = {-kEmptyPlane, -kEmptyPlane, -kEmptyPlane};

    bool empty() const { return lower.x > upper.x; }

    void extend(vec3 p) {
        lower = lesser3(lower, p);
        upper = greater3(upper, p);
    }
    void extend(const Box& b) {
        lower = lesser3(lower, b.lower);
        upper = greater3(upper, b.upper);
    }

    bool operator==(const Box&) const = default;
};

/// The box of a slot whose leaf's vertices have these bounds: the slab test relies on its pad.
inline Box padded(const Box& bounds) {
    if (bounds.empty()) return bounds;
    const float extent = largest_extent(bounds.lower, bounds.upper);
    Box box = bounds;
    for (int axis = 0; axis < 3; ++axis) {
        box.lower[axis] -= plane_pad(box.lower[axis], extent);
        box.upper[axis] += plane_pad(box.upper[axis], extent);
    }
    return box;
}

/// Half the surface area; 0 for an empty box. In double, in which products of scene-space extents
/// are exact enough for equal areas to compare equal.
inline double half_area(const Box& b) {
    if (b.empty()) return 0;
    const double dx = static_cast<double>(b.upper.x) - b.lower.x;
    const double dy = static_cast<double>(b.upper.y) - b.lower.y;
    const double dz = static_cast<double>(b.upper.z) - b.lower.z;
    return dx * dy + dy * dz + dz * dx;
}

/// Whether a vertex in scene space is finite (see SceneSpace::to_scene).
inline bool is_finite_vertex(vec3 p) { return p.x <= kSceneExtent; }

}  // namespace mray
