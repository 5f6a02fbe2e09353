// Wedges of a packet: planes through its origin and parallel to an axis of scene space, with all
// rays on one side. They exclude boxes that the sides of its rectangle do not, above all boxes that
// reach behind the origin beside the rays: a box and a cone of rays may be apart by a plane that is
// parallel to an edge of the box and holds an edge of the cone, and by no side of either (S.
// Gottschalk, M. Lin, D. Manocha. OBBTree: a hierarchical structure for rapid interference
// detection. 1996, section 5).
#if defined(MORPHRAY_CPU_PACKET_PACKET_NODE_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef MORPHRAY_CPU_PACKET_PACKET_NODE_INL_H
#undef MORPHRAY_CPU_PACKET_PACKET_NODE_INL_H
#else
#define MORPHRAY_CPU_PACKET_PACKET_NODE_INL_H
#endif

#include <hwy/highway.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "common/interop/bvh_layout.h"
#include "common/interop/packet_bounds.h"
#include "cpu/packet/packet_frame-inl.h"
#include "cpu/packet/packet_frame.h"
#include "cpu/simd/hit_rule-inl.h"

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

// The boxes of a node in the plane of a packet.

/// Sets the least and the greatest value of row k of the projection over boxes relative to the
/// origin. size: the largest coordinate of each box.
///
/// In units of 2^-24 row_size[k] size:
/// 1. The products and sums are off by at most 5.
/// 2. The rule displaces a vertex by 2^-22 of its distance from the ray, at most 2 size, so that
///    triangles reach out of their box by at most 8.
/// 3. kBoxError widens the range by 16 on both sides (lab/proofs/packet_rectangles.g).
HWY_INLINE void project_boxes(const PacketFrame& frame, int k, const FloatVec lower[3],
                              const FloatVec upper[3], FloatVec size, FloatVec& least,
                              FloatVec& most) {
    least = zero();
    most = zero();
    for (int axis = 0; axis < 3; ++axis) {
        const float row = frame.rows_f[k][axis];
        least = mul_add(splat(row), row >= 0 ? lower[axis] : upper[axis], least);
        most = mul_add(splat(row), row >= 0 ? upper[axis] : lower[axis], most);
    }
    const FloatVec error = splat(kBoxError * frame.row_size[k]) * size;
    least = least - error;
    most = most + error;
}

/// A box is in front of the origin if its least z is more than this part of its greatest: else it
/// counts as reaching to the origin.
inline constexpr float kNearestPart = 0x1p-20f;

/// 1 / z at its farthest, times z: kNearestByDepth for the other side.
inline constexpr float kFarthestByDepth = 0.99999f;

/// Stores the rectangles in which boxes with these bounds of x, y, z are seen. Returns which of
/// them the packet may meet.
///
/// A point that is seen has z > 0. If x > 0 for all of a box, x / z is at least the least x over
/// the greatest z, whether the box is in front of the origin or reaches behind it; so if x < 0,
/// too. On the other sides a box that is not in front of the origin has no bound.
HWY_INLINE Mask rectangle_of_box(const PacketFrame& frame, const FloatVec least[3],
                                 const FloatVec most[3], Rectangles& r, std::size_t l) {
    const FloatVec all = splat(kWholePlane);
    const Mask in_front = least[2] > most[2] * splat(kNearestPart);
    const FloatVec by_near = splat(kNearestByDepth) / max(least[2], splat(kLeastDivisor));
    const FloatVec by_far = splat(kFarthestByDepth) / max(most[2], splat(kLeastDivisor));
    const auto low = [&](FloatVec x) {
        return select(x < zero(), select(in_front, x * by_near, -all), x * by_far);
    };
    const auto high = [&](FloatVec x) {
        return select(x > zero(), select(in_front, x * by_near, all), x * by_far);
    };
    const FloatVec lower_x = low(least[0]);
    const FloatVec upper_x = high(most[0]);
    const FloatVec lower_y = low(least[1]);
    const FloatVec upper_y = high(most[1]);
    store(lower_x, r.lower_x + l);
    store(upper_x, r.upper_x + l);
    store(lower_y, r.lower_y + l);
    store(upper_y, r.upper_y + l);
    // The packet's four sides exclude boxes that reach behind the origin, too: x - side * z has one
    // sign over all corners.
    const auto beyond = [&](FloatVec upper, FloatVec lower_z, FloatVec upper_z, float side) {
        return upper < splat(side) * (side > 0 ? lower_z : upper_z);
    };
    const auto before = [&](FloatVec lower, FloatVec lower_z, FloatVec upper_z, float side) {
        return lower > splat(side) * (side > 0 ? upper_z : lower_z);
    };
    const Mask outside = beyond(most[0], least[2], most[2], frame.lower_x) |
                         before(least[0], least[2], most[2], frame.upper_x) |
                         (beyond(most[1], least[2], most[2], frame.lower_y) |
                          before(least[1], least[2], most[2], frame.upper_y));
    return and_not(outside, most[2] > zero());
}

/// A node's children in a packet's plane: their rectangles, and nearest_q.
struct alignas(64) NodeChildren {
    Rectangles rectangles;
    float q[16];
};

/// Projects a node's children. Returns those that the packet may meet, as bits.
///
/// These are never empty slots. The box of such a slot has kEmptyPlane = 2^48 as its lower planes,
/// and as its upper ones -2^48, while |org| <= kOriginExtent = 2^40. So `most` of z adds products
/// that are all 0 or less, to at most -(1 - 2^-7) 2^48 row_size, and its error, of at most 2^-19 of
/// that size, makes it at most 0.
HWY_INLINE std::uint32_t project_node(const PacketFrame& frame, const Node& node,
                                      NodeChildren& children) {
    std::uint32_t hits = 0;
    for (std::size_t l = 0; l < kWidth; l += kLanes) {
        const FloatVec org[3] = {splat(frame.org.x), splat(frame.org.y), splat(frame.org.z)};
        const FloatVec lower[3] = {load_unaligned(node.lower_x + l) - org[0],
                                   load_unaligned(node.lower_y + l) - org[1],
                                   load_unaligned(node.lower_z + l) - org[2]};
        const FloatVec upper[3] = {load_unaligned(node.upper_x + l) - org[0],
                                   load_unaligned(node.upper_y + l) - org[1],
                                   load_unaligned(node.upper_z + l) - org[2]};
        FloatVec largest = zero();
        for (int axis = 0; axis < 3; ++axis) {
            largest = max(largest, max(abs(lower[axis]), abs(upper[axis])));
        }
        FloatVec least[3], most[3];
        for (int k = 0; k < 3; ++k)
            project_boxes(frame, k, lower, upper, largest, least[k], most[k]);
        const Mask keep = and_not(outside_wedges(frame, lower, upper, largest),
                                  rectangle_of_box(frame, least, most, children.rectangles, l));
        store(nearest_q(least[2] - splat(frame.depth_error)), children.q + l);
        hits |= bits_of(keep) << l;
    }
    return hits;
}

}  // namespace HWY_NAMESPACE
}  // namespace mray::cpu
HWY_AFTER_NAMESPACE();

#endif  // per target
