// The boxes of a node in the plane of a packet.

#if defined(MORPHRAY_CPU_PACKET_PACKET_NODE_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef MORPHRAY_CPU_PACKET_PACKET_NODE_INL_H
#undef MORPHRAY_CPU_PACKET_PACKET_NODE_INL_H
#else
#define MORPHRAY_CPU_PACKET_PACKET_NODE_INL_H
#endif

#include <hwy/highway.h>

#include <cstddef>
#include <cstdint>

#include "common/bvh/bvh.h"
#include "common/interop/bvh_layout.h"
#include "common/interop/packet_bounds.h"
#include "cpu/packet/packet_frame-inl.h"
#include "cpu/packet/packet_wedge-inl.h"
#include "cpu/simd/fast_hit_rule-inl.h"

HWY_BEFORE_NAMESPACE();
namespace mray::cpu {
namespace HWY_NAMESPACE {

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

/// Prefetches a child's memory without a branch: a leaf's first lines are prefetched twice.
HWY_INLINE void prefetch_child(const Bvh& bvh, std::uint32_t child) {
    static_assert(sizeof(Leaf) <= sizeof(Node));
    const bool is_leaf = (child & kLeafBit) != 0;
    const char* const bytes = is_leaf
                                  ? reinterpret_cast<const char*>(&bvh.leaves[child & ~kLeafBit])
                                  : reinterpret_cast<const char*>(&bvh.nodes[child]);
    prefetch(bytes, sizeof(Leaf));
    prefetch(bytes + (is_leaf ? 0 : sizeof(Leaf)), sizeof(Node) - sizeof(Leaf));
}

}  // namespace HWY_NAMESPACE
}  // namespace mray::cpu
HWY_AFTER_NAMESPACE();

#endif
