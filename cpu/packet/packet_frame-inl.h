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
#include "cpu/simd/hit_rule-inl.h"

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

/// Sets what a frame knows of its rays in scene space. The rows must be set. Directions are bounded
/// at the corners of a square that holds all rays. Since row 2 of a direction is 1 at z = 1, its
/// largest component is at least 1 / row_size[2].
HWY_INLINE void bound_directions(PacketFrame& frame, const double axis_x[3], const double axis_y[3],
                                 const double axis_z[3]) {
    double least[3], most[3];
    for (int axis = 0; axis < 3; ++axis) {
        const double spread = frame.reach * (std::abs(axis_x[axis]) + std::abs(axis_y[axis]));
        const double towards = std::abs(axis_z[axis]);
        least[axis] = towards - spread;
        most[axis] = towards + spread;
    }
    // A lower bound of each ray's largest component.
    const double largest = std::max({1.0 / frame.row_size[2], least[0], least[1], least[2]});
    std::uint32_t axis_count = 0;
    frame.depth_most = 0;
    for (std::uint32_t axis = 0; axis < 3; ++axis) {
        if (largest > kSureOrder * most[axis]) continue;
        ++axis_count;
        frame.axis = axis;
        frame.axis_sign = axis_z[axis] < 0 ? -1.0f : 1.0f;
        frame.depth_most = std::max(frame.depth_most, static_cast<float>(most[axis] * kWiden));
    }
    if (axis_count != 1) frame.axis = kMixedAxes;
    frame.depth_least = static_cast<float>(largest * kNarrow);
    frame.per_depth = 1 / frame.depth_least;
}

/// Sets the rows that invert (axis_x, axis_y, axis_z).
HWY_INLINE void set_rows(PacketFrame& frame, const double axis_x[3], const double axis_y[3],
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
}

/// A hit is off by less than this part of the depth margin on any axis (docs/design/arithmetic.md,
/// "Boxes").
inline constexpr float kHitErrorOfMargin = 0.5625f;

/// Sets the frame whose plane point (X, Y) lies at org + axis_x X + axis_y Y + axis_z, for |X|, |Y|
/// up to `reach`. It has no wedges.
///
/// depth_error: a hit is off by kHitErrorOfMargin * depth_margin on an axis; in z, by that over the
/// ray's largest component at z = 1.
HWY_INLINE void set_frame(PacketFrame& frame, vec3 org, const double axis_x[3],
                          const double axis_y[3], const double axis_z[3], float reach) {
    set_rows(frame, axis_x, axis_y, axis_z);
    frame.org = org;
    frame.reach = reach;
    frame.depth_margin = depth_margin(org);
    bound_directions(frame, axis_x, axis_y, axis_z);
    frame.depth_error = kHitErrorOfMargin * frame.depth_margin * frame.per_depth;
    frame.wedge_side_count = 0;
}

}  // namespace HWY_NAMESPACE
}  // namespace mray::cpu
HWY_AFTER_NAMESPACE();

#endif
