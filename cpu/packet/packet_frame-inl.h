// The plane of a packet: how it is made, the rectangles that are seen in it, and depths as 1/z.

#if defined(MORPHRAY_CPU_PACKET_PACKET_FRAME_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef MORPHRAY_CPU_PACKET_PACKET_FRAME_INL_H
#undef MORPHRAY_CPU_PACKET_PACKET_FRAME_INL_H
#else
#define MORPHRAY_CPU_PACKET_PACKET_FRAME_INL_H
#endif

#include <hwy/highway.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "common/interop/packet_bounds.h"
#include "common/interop/slab.h"
#include "cpu/packet/packet_frame.h"
#include "cpu/simd/hit_rule-inl.h"

HWY_BEFORE_NAMESPACE();
namespace mray::cpu {
namespace HWY_NAMESPACE {

/// Rectangles in the packet's plane, one a lane.
struct RectangleLanes {
    FloatVec lower_x, upper_x, lower_y, upper_y;

    HWY_INLINE RectangleLanes(FloatVec left, FloatVec right, FloatVec low, FloatVec high)
        : lower_x(left), upper_x(right), lower_y(low), upper_y(high) {}
    /// The same one in all lanes.
    HWY_INLINE explicit RectangleLanes(const PlaneRectangle& r)
        : RectangleLanes(splat(r.lower_x), splat(r.upper_x), splat(r.lower_y), splat(r.upper_y)) {}
    /// Rectangles i and following, one a lane.
    template <std::size_t kCount>
    HWY_INLINE RectangleLanes(const PlaneRectangles<kCount>& r, std::size_t i)
        : RectangleLanes(load(r.lower_x + i), load(r.upper_x + i), load(r.lower_y + i),
                         load(r.upper_y + i)) {}

    template <std::size_t kCount>
    HWY_INLINE void put(PlaneRectangles<kCount>& r, std::size_t i) const {
        store(lower_x, r.lower_x + i);
        store(upper_x, r.upper_x + i);
        store(lower_y, r.lower_y + i);
        store(upper_y, r.upper_y + i);
    }
    HWY_INLINE void add(const RectangleLanes& r) {
        lower_x = min(lower_x, r.lower_x);
        upper_x = max(upper_x, r.upper_x);
        lower_y = min(lower_y, r.lower_y);
        upper_y = max(upper_y, r.upper_y);
    }

    HWY_INLINE Mask meets(const RectangleLanes& r) const {
        const Mask x = (lower_x <= r.upper_x) & (upper_x >= r.lower_x);
        const Mask y = (lower_y <= r.upper_y) & (upper_y >= r.lower_y);
        return x & y;
    }
    HWY_INLINE Mask holds(FloatVec x, FloatVec y) const {
        const Mask in_x = (x >= lower_x) & (x <= upper_x);
        const Mask in_y = (y >= lower_y) & (y <= upper_y);
        return in_x & in_y;
    }
};

using Rectangles = PlaneRectangles<16>;

/// Divisors of a quotient that is used only where they are positive are at least this: no quotient
/// overflows.
inline constexpr float kLeastDivisor = 1e-20f;

/// An upper bound of 1/z of a hit that is no nearer than z = near; kAnyDepth where near <= 0.
HWY_INLINE FloatVec nearest_q(FloatVec near) {
    const FloatVec q = splat(kNearestByDepth) / max(near, splat(kLeastDivisor));
    return select(near > zero(), q, splat(kAnyDepth));
}

HWY_INLINE float least_lane(FloatVec v) { return hn::GetLane(hn::MinOfLanes(kFloats, v)); }
HWY_INLINE float most_lane(FloatVec v) { return hn::GetLane(hn::MaxOfLanes(kFloats, v)); }

/// The least of a block's q_lower: no hit with a smaller 1/z concerns any of its rays.
HWY_INLINE float least_q(const float* q_lower) {
    FloatVec least = splat(kDone);
    for (std::size_t l = 0; l < kBlockRays; l += kLanes) least = min(least, load(q_lower + l));
    return least_lane(least);
}

/// Reduces each of four vectors to one of four floats, which are aligned. combine: min or max of
/// two vectors.
template <class Combine>
HWY_INLINE void reduce_four(const FloatVec vectors[4], Combine combine, float* out) {
#if HWY_TARGET == HWY_SCALAR
    for (std::size_t i = 0; i < 4; ++i) out[i] = hn::GetLane(vectors[i]);
    (void)combine;
#else
    hn::Store(reduce_blocks(kFloats, combine_four(vectors, combine), combine), hn::Full128<float>(),
              out);
#endif
}

// ---- Making a frame

/// Bounds made in double are widened by 0.1 % before they are rounded to float, 2^-24 of them.
inline constexpr double kWiden = 1.001;
inline constexpr double kNarrow = 0.999;

/// Two magnitudes made in double that differ by less than 0.01 % count as equal.
inline constexpr double kSureOrder = 1.0001;

/// The plane of a frame: its point (X, Y) lies at x X + y Y + z from the origin.
struct PlaneAxes {
    glm::dvec3 x, y, z;
};

/// Sets what a frame knows of its rays in scene space. The rows must be set. Directions are bounded
/// at the corners of a square that holds all rays. Since row 2 of a direction is 1 at z = 1, its
/// largest component is at least 1 / row_size[2].
HWY_INLINE void bound_directions(PacketFrame& frame, const PlaneAxes& axes) {
    const glm::dvec3 spread = (glm::abs(axes.x) + glm::abs(axes.y)) * double{frame.reach};
    const glm::dvec3 least = glm::abs(axes.z) - spread;
    const glm::dvec3 most = glm::abs(axes.z) + spread;
    // A lower bound of each ray's largest component.
    const double largest = std::max({1.0 / frame.row_size[2], least.x, least.y, least.z});
    int axis_count = 0;
    frame.depth_most = 0;
    for (int axis = 0; axis < 3; ++axis) {
        if (largest > kSureOrder * most[axis]) continue;
        ++axis_count;
        frame.axis = static_cast<std::uint32_t>(axis);
        frame.axis_sign = axes.z[axis] < 0 ? -1.0f : 1.0f;
        frame.depth_most = std::max(frame.depth_most, static_cast<float>(most[axis] * kWiden));
    }
    if (axis_count != 1) frame.axis = kMixedAxes;
    frame.depth_least = static_cast<float>(largest * kNarrow);
    frame.per_depth = 1 / frame.depth_least;
}

/// Sets the rows that invert the axes.
HWY_INLINE void set_rows(PacketFrame& frame, const PlaneAxes& axes) {
    const glm::dvec3 rows[3] = {glm::cross(axes.y, axes.z), glm::cross(axes.z, axes.x),
                                glm::cross(axes.x, axes.y)};
    const double det = glm::dot(axes.x, rows[0]);
    for (int k = 0; k < 3; ++k) {
        frame.row_size[k] = 0;
        for (int axis = 0; axis < 3; ++axis) {
            frame.rows[k][axis] = rows[k][axis] / det;
            frame.rows_f[k][axis] = static_cast<float>(frame.rows[k][axis]);
            frame.row_size[k] += std::abs(frame.rows_f[k][axis]);
        }
    }
}

/// A hit is off by less than this part of the depth margin on any axis (docs/design/arithmetic.md,
/// "Boxes").
inline constexpr float kHitErrorOfMargin = 0.5625f;

/// Sets the frame of a plane at `org`, for |X|, |Y| up to `reach`. It has no wedges.
///
/// depth_error: a hit is off by kHitErrorOfMargin * depth_margin on an axis; in z, by that over the
/// ray's largest component at z = 1.
HWY_INLINE void set_frame(PacketFrame& frame, vec3 org, const PlaneAxes& axes, float reach) {
    set_rows(frame, axes);
    frame.org = org;
    frame.reach = reach;
    frame.depth_margin = depth_margin(org);
    bound_directions(frame, axes);
    frame.depth_error = kHitErrorOfMargin * frame.depth_margin * frame.per_depth;
    frame.wedge_side_count = 0;
}

}  // namespace HWY_NAMESPACE
}  // namespace mray::cpu
HWY_AFTER_NAMESPACE();

#endif
