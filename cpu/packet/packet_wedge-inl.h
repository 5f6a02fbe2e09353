// Wedges of a packet: planes through its origin and parallel to an axis of scene space, with all
// rays on one side. They exclude boxes that the sides of its rectangle do not, above all boxes that
// reach behind the origin beside the rays: a box and a cone of rays may be apart by a plane that is
// parallel to an edge of the box and holds an edge of the cone, and by no side of either (S.
// Gottschalk, M. Lin, D. Manocha. OBBTree: a hierarchical structure for rapid interference
// detection. 1996, section 5).

#if defined(MORPHRAY_CPU_PACKET_PACKET_WEDGE_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef MORPHRAY_CPU_PACKET_PACKET_WEDGE_INL_H
#undef MORPHRAY_CPU_PACKET_PACKET_WEDGE_INL_H
#else
#define MORPHRAY_CPU_PACKET_PACKET_WEDGE_INL_H
#endif

#include <hwy/highway.h>

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "common/interop/packet_bounds.h"
#include "cpu/packet/packet_frame.h"
#include "cpu/simd/fast_hit_rule-inl.h"

HWY_BEFORE_NAMESPACE();
namespace mray::cpu {
namespace HWY_NAMESPACE {

/// Whether a frame's rows, found in double, are the inverse of its axes but for 2^-18, and its
/// corners, in double, exact enough for the margin of wedges.
HWY_INLINE bool may_have_wedges(const PacketFrame& frame, const double axis_x[3],
                                const double axis_y[3], const double axis_z[3]) {
    const auto size = [](const double* axis) {
        return std::max({std::abs(axis[0]), std::abs(axis[1]), std::abs(axis[2])});
    };
    const double span = axis_x[0] * (axis_y[1] * axis_z[2] - axis_y[2] * axis_z[1]) +
                        axis_x[1] * (axis_y[2] * axis_z[0] - axis_y[0] * axis_z[2]) +
                        axis_x[2] * (axis_y[0] * axis_z[1] - axis_y[1] * axis_z[0]);
    return std::abs(span) > kLeastWedgeSpan * size(axis_x) * size(axis_y) * size(axis_z) &&
           frame.depth_most <= kMostWedgeDepths * frame.depth_least;
}

/// Sets the wedges of a frame whose rays go through the points (X, Y), within its bounds of x and
/// y, of the plane axis_x X + axis_y Y + axis_z.
///
/// 1. Every direction is a mean of those through the four corners of the rectangle, by weights that
///    are not negative. So where all corners are on one side of a plane, all rays are.
/// 2. Seen along an axis, the plane through the outermost corner on each side is such a plane, or
///    none is.
HWY_INLINE void set_wedges(PacketFrame& frame, const double axis_x[3], const double axis_y[3],
                           const double axis_z[3]) {
    frame.wedge_side_count = 0;
    if (!may_have_wedges(frame, axis_x, axis_y, axis_z)) return;
    double corner[4][3];
    for (int k = 0; k < 4; ++k) {
        const double x = (k & 1) != 0 ? frame.upper_x : frame.lower_x;
        const double y = (k & 2) != 0 ? frame.upper_y : frame.lower_y;
        for (int axis = 0; axis < 3; ++axis)
            corner[k][axis] = axis_x[axis] * x + axis_y[axis] * y + axis_z[axis];
    }
    for (std::uint32_t axis = 0; axis < 3; ++axis) {
        const std::uint32_t u = (axis + 1) % 3;
        const std::uint32_t v = (axis + 2) % 3;
        for (const double side : {1.0, -1.0}) {
            // How far corner q is inside the plane through corner p.
            const auto inside = [&](int p, int q) {
                return side * (corner[p][u] * corner[q][v] - corner[p][v] * corner[q][u]);
            };
            int outermost = 0;
            for (int k = 1; k < 4; ++k)
                if (inside(outermost, k) < 0) outermost = k;
            bool holds_all = true;
            for (int k = 0; k < 4; ++k) holds_all &= inside(outermost, k) >= 0;
            const double size = std::abs(corner[outermost][u]) + std::abs(corner[outermost][v]);
            if (!holds_all || !(size > 0)) continue;
            WedgeSide& plane = frame.wedge_sides[frame.wedge_side_count++];
            plane.axes[0] = u;
            plane.axes[1] = v;
            plane.normal[0] = static_cast<float>(-side * corner[outermost][v] / size);
            plane.normal[1] = static_cast<float>(side * corner[outermost][u] / size);
        }
    }
}

/// The boxes, with bounds relative to the origin, that no ray of the packet meets because they are
/// outside a wedge. size: the largest coordinate of each box.
///
/// A ray's point t d in the box has n.(t d) >= 0 but for the error of n, which is far less than
/// kWedgeMargin of t d (lab/proofs/packet_rectangles.g).
HWY_INLINE Mask outside_wedges(const PacketFrame& frame, const FloatVec lower[3],
                               const FloatVec upper[3], FloatVec size) {
    const FloatVec limit = splat(-kWedgeMargin) * size;
    Mask outside = limit > zero();
    for (std::uint32_t k = 0; k < frame.wedge_side_count; ++k) {
        const WedgeSide& side = frame.wedge_sides[k];
        FloatVec most = zero();
        for (int i = 0; i < 2; ++i) {
            const FloatVec bound = side.normal[i] >= 0 ? upper[side.axes[i]] : lower[side.axes[i]];
            most = mul_add(splat(side.normal[i]), bound, most);
        }
        outside = outside | (most < limit);
    }
    return outside;
}

}  // namespace HWY_NAMESPACE
}  // namespace mray::cpu
HWY_AFTER_NAMESPACE();

#endif
