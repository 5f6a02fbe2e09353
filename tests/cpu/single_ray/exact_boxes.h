// The answers that the tests of boxes on lanes may give.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "common/interop/bvh_layout.h"
#include "common/interop/slab.h"

namespace mray::cpu {

/// From where to where a line is within a box, from 0 on, and where it enters on its main axis; in
/// exact arithmetic but for some units of double.
struct Interval {
    double enter = 0;
    double leave = kInfiniteT;
    double along = 0;
};

/// The box is dilated by these parts of |org| and of the rays' extent.
inline Interval exact_interval(const Node& node, std::uint32_t slot, const Ray& ray,
                               double of_origin, double of_extent) {
    const float* const lower[3] = {node.lower_x, node.lower_y, node.lower_z};
    const float* const upper[3] = {node.upper_x, node.upper_y, node.upper_z};
    Interval result;
    for (std::uint32_t axis = 0; axis < 3; ++axis) {
        const double org = ray.org[axis];
        const double dir = ray.dir[axis];
        const double dilation = of_origin * std::abs(org) + of_extent * extent_of_rays(ray.org);
        const double from = lower[axis][slot] - dilation - org;
        const double to = upper[axis][slot] + dilation - org;
        if (dir == 0) {
            if (from > 0 || to < 0) result.leave = -1;
            continue;
        }
        const double entry = std::min(from / dir, to / dir);
        result.enter = std::max(result.enter, entry);
        result.leave = std::min(result.leave, std::max(from / dir, to / dir));
        if (axis == largest_axis(ray.dir)) result.along = entry;
    }
    return result;
}

/// Whether this is an answer that the proof in cpu/single_ray/node_lanes-inl.h allows: every box
/// that the line passes within 2^-42 of the extent is met, and none that it passes at some ulp.
inline bool is_allowed(const Node& node, std::uint32_t slot, const Ray& ray, bool near,
                       float t_least) {
    const Interval inner = exact_interval(node, slot, ray, 0, 0x1p-42);
    const Interval outer = exact_interval(node, slot, ray, 0x1p-21, 0x1p-39);
    if (inner.enter <= std::min<double>(inner.leave, ray.tfar) &&
        !(near && t_least <= inner.enter * (1 + 0x1p-21))) {
        return false;
    }
    // A ray without a direction meets some at once that it is not in, far beyond any t.
    if (largest_component(ray.dir) == 0) return true;
    const double margin = depth_margin(ray.org);
    const double least = std::max(outer.along, outer.enter - margin);
    const double rounding = 0x1p-19 * std::max(std::abs(outer.along), outer.enter);
    return !near || (outer.enter <= outer.leave * (1 + 0x1p-19) &&
                     least <= ray.tfar * (1 + 0x1p-19) + rounding && t_least >= least - rounding);
}

}  // namespace mray::cpu
