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

#include "common/interop/packet_bounds.h"
#include "common/interop/slab.h"
#include "cpu/packet/packet_frame.h"
#include "cpu/simd/fast_hit_rule-inl.h"

HWY_BEFORE_NAMESPACE();
namespace mray::cpu {
namespace HWY_NAMESPACE {

/// Rectangles in the packet's plane, sixteen at a time.
struct alignas(64) Rectangles {
    float lower_x[16], upper_x[16], lower_y[16], upper_y[16];
};

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

// ---- Making a frame

/// Bounds made in double are widened by 0.1 % before they are rounded to float, 2^-24 of them.
inline constexpr double kWiden = 1.001;
inline constexpr double kNarrow = 0.999;

/// Two magnitudes made in double that differ by less than 0.01 % count as equal.
inline constexpr double kSureOrder = 1.0001;

/// The largest |a - b t| over t = p / q with |t| <= 1, for p and q from ranges.
HWY_INLINE double most_across(double a, double b, const double p[2], const double q[2]) {
    double least = -1, most = 1;
    if (q[0] > 0 || q[1] < 0) {
        const double ends[4] = {p[0] / q[0], p[0] / q[1], p[1] / q[0], p[1] / q[1]};
        least = std::max(least, *std::min_element(ends, ends + 4));
        most = std::min(most, *std::max_element(ends, ends + 4));
    }
    return std::max(std::abs(a - b * least), std::abs(a - b * most));
}

/// Sets what a frame knows of its rays in scene space. It is found at the corners of a square that
/// holds all rays: the square is convex, and so are the directions of one largest component and
/// sign.
HWY_INLINE void bound_directions(PacketFrame& frame, const double axis_x[3], const double axis_y[3],
                                 const double axis_z[3]) {
    double least[3], most[3];
    double range[3][2];
    double unit[2] = {0, 0};
    for (int axis = 0; axis < 3; ++axis) {
        const double spread = frame.reach * (std::abs(axis_x[axis]) + std::abs(axis_y[axis]));
        const double towards = std::abs(axis_z[axis]);
        least[axis] = towards - spread;
        most[axis] = towards + spread;
        range[axis][0] = axis_z[axis] - spread;
        range[axis][1] = axis_z[axis] + spread;
        unit[0] += std::abs(axis_x[axis]);
        unit[1] += std::abs(axis_y[axis]);
    }
    frame.unit = static_cast<float>(std::max(unit[0], unit[1]) * kWiden);
    frame.axis = kMixedAxes;
    frame.axis_count = 0;
    frame.depth_most = 0;
    frame.across = 0;
    // A lower bound of each ray's largest component.
    const double largest = std::max(least[0], std::max(least[1], least[2]));
    for (std::uint32_t axis = 0; axis < 3; ++axis) {
        if (largest > kSureOrder * most[axis]) continue;
        frame.axis = axis;
        float* const row = frame.depth_rows[frame.axis_count++];
        row[0] = static_cast<float>(axis_x[axis]);
        row[1] = static_cast<float>(axis_y[axis]);
        row[2] = static_cast<float>(axis_z[axis]);
        frame.depth_most = std::max(frame.depth_most, static_cast<float>(most[axis] * kWiden));
        for (const double* step : {axis_x, axis_y}) {
            double across = 0;
            for (const std::uint32_t other : {(axis + 1) % 3, (axis + 2) % 3})
                across += most_across(step[other], step[axis], range[other], range[axis]);
            frame.across = std::max(frame.across, static_cast<float>(across * kWiden));
        }
    }
    if (frame.axis_count != 1) frame.axis = kMixedAxes;
    if (!(largest > 0)) {  // the rays spread too widely for these bounds
        frame.axis_count = 0;
        return;
    }
    frame.depth_least = static_cast<float>(largest * kNarrow);
    frame.per_depth = 1 / frame.depth_least;
}

/// Sets the rows that invert (axis_x, axis_y, axis_z). Returns the determinant of the axes.
HWY_INLINE double set_rows(PacketFrame& frame, const double axis_x[3], const double axis_y[3],
                           const double axis_z[3]) {
    const auto cross = [](const double* p, const double* q, double* out) {
        out[0] = p[1] * q[2] - p[2] * q[1];
        out[1] = p[2] * q[0] - p[0] * q[2];
        out[2] = p[0] * q[1] - p[1] * q[0];
    };
    cross(axis_y, axis_z, frame.rows[0]);
    cross(axis_z, axis_x, frame.rows[1]);
    cross(axis_x, axis_y, frame.rows[2]);
    const double det =
        axis_x[0] * frame.rows[0][0] + axis_x[1] * frame.rows[0][1] + axis_x[2] * frame.rows[0][2];
    for (int k = 0; k < 3; ++k) {
        frame.row_size[k] = 0;
        for (int axis = 0; axis < 3; ++axis) {
            frame.rows[k][axis] /= det;
            frame.rows_f[k][axis] = static_cast<float>(frame.rows[k][axis]);
            frame.row_size[k] += std::abs(frame.rows_f[k][axis]);
        }
    }
    return det;
}

/// A hit is off by less than this part of the depth margin on any axis (docs/design/arithmetic.md,
/// "Boxes").
inline constexpr float kHitErrorOfMargin = 0.5625f;

/// Sets the frame whose plane point (X, Y) lies at org + axis_x X + axis_y Y + axis_z, for |X|, |Y|
/// up to `reach`.
///
/// depth_error: a hit is off by kHitErrorOfMargin * depth_margin on an axis; in z, by that over the
/// ray's largest component at z = 1. A ray at z = 1 is not shorter than 1, so that component is at
/// least 0.57 and depth_error at most the depth margin, whatever the axes.
HWY_INLINE void set_frame(PacketFrame& frame, vec3 org, const double axis_x[3],
                          const double axis_y[3], const double axis_z[3], float reach) {
    const double det = set_rows(frame, axis_x, axis_y, axis_z);
    frame.org = org;
    frame.reach = reach;
    frame.depth_margin = depth_margin(org);
    frame.per_volume = static_cast<float>(kWiden / std::abs(det));
    bound_directions(frame, axis_x, axis_y, axis_z);
    frame.depth_error = frame.depth_margin;
    if (frame.axis_count != 0)
        frame.depth_error *= std::min(1.0f, kHitErrorOfMargin * frame.per_depth);
}

}  // namespace HWY_NAMESPACE
}  // namespace mray::cpu
HWY_AFTER_NAMESPACE();

#endif
