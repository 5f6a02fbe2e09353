// The boxes of a node in the plane of a packet.

#if defined(MORPHRAY_CPU_PACKET_PACKET_NODE_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef MORPHRAY_CPU_PACKET_PACKET_NODE_INL_H
#undef MORPHRAY_CPU_PACKET_PACKET_NODE_INL_H
#else
#define MORPHRAY_CPU_PACKET_PACKET_NODE_INL_H
#endif

#include <hwy/cache_control.h>
#include <hwy/highway.h>

#include <cstddef>
#include <cstdint>

#include "common/bvh/bvh.h"
#include "common/interop/bvh_layout.h"
#include "common/interop/packet_bounds.h"
#include "cpu/packet/packet.h"
#include "cpu/packet/packet_blocks-inl.h"
#include "cpu/simd/rule_vectors-inl.h"

HWY_BEFORE_NAMESPACE();
namespace morphray::cpu {
namespace HWY_NAMESPACE {

/// Least and greatest of row k of the projection over boxes given relative to the origin.
/// In units of 2^-24 of row_size times the largest coordinate, products and sums are off by at
/// most 5, and the triangles that the rule sees reach out of their boxes by at most 8 (2^-22 of
/// a vertex's distance from the ray, at most twice that coordinate): 16 on both sides.
HWY_INLINE void project_boxes(const PacketFrame& frame, int k, const VF lower[3], const VF upper[3],
                              VF size, VF& least, VF& most) {
    least = hn::Zero(Floats());
    most = hn::Zero(Floats());
    for (int axis = 0; axis < 3; ++axis) {
        const float row = frame.rows_f[k][axis];
        least = hn::MulAdd(splat(row), row >= 0 ? lower[axis] : upper[axis], least);
        most = hn::MulAdd(splat(row), row >= 0 ? upper[axis] : lower[axis], most);
    }
    const VF error = hn::Mul(splat(kBoxError * frame.row_size[k]), size);
    least = hn::Sub(least, error);
    most = hn::Add(most, error);
}

/// The rectangle that boxes with these bounds of x, y, z are seen in: all of the plane when
/// they reach to the eye or behind it. Whether it meets the packet, and the box is not behind.
HWY_INLINE Mask rectangle_of_box(const PacketFrame& frame, const VF least[3], const VF most[3],
                                 Rectangles& r, std::size_t l) {
    const Floats f;
    const VF zero = hn::Zero(f);
    const VF all = splat(1e6f);
    const Mask in_front = hn::Gt(least[2], hn::Mul(most[2], splat(0x1p-20f)));
    const VF by_near = hn::Div(splat(kNearestByDepth), hn::Max(least[2], splat(1e-20f)));
    const VF by_far = hn::Div(splat(0.99999f), hn::Max(most[2], splat(1e-20f)));
    const auto low = [&](VF x) {
        return hn::IfThenElse(
            in_front, hn::Mul(x, hn::IfThenElse(hn::Lt(x, zero), by_near, by_far)), hn::Neg(all));
    };
    const auto high = [&](VF x) {
        return hn::IfThenElse(in_front,
                              hn::Mul(x, hn::IfThenElse(hn::Gt(x, zero), by_near, by_far)), all);
    };
    const VF lower_x = low(least[0]);
    const VF upper_x = high(most[0]);
    const VF lower_y = low(least[1]);
    const VF upper_y = high(most[1]);
    hn::Store(lower_x, f, r.lower_x + l);
    hn::Store(upper_x, f, r.upper_x + l);
    hn::Store(lower_y, f, r.lower_y + l);
    hn::Store(upper_y, f, r.upper_y + l);
    // A box that reaches behind is held against the packet's four sides: x - side * z over its
    // corners.
    const auto beyond = [&](VF upper, VF lower_z, VF upper_z, float side) {
        return hn::Lt(upper, hn::Mul(splat(side), side > 0 ? lower_z : upper_z));
    };
    const auto before = [&](VF lower, VF lower_z, VF upper_z, float side) {
        return hn::Gt(lower, hn::Mul(splat(side), side > 0 ? upper_z : lower_z));
    };
    const Mask outside = hn::Or(hn::Or(beyond(most[0], least[2], most[2], frame.lower_x),
                                       before(least[0], least[2], most[2], frame.upper_x)),
                                hn::Or(beyond(most[1], least[2], most[2], frame.lower_y),
                                       before(least[1], least[2], most[2], frame.upper_y)));
    return hn::AndNot(outside, hn::Gt(most[2], zero));
}

/// What a packet sees of a node's children: rectangles of its plane, and nearest_q.
struct alignas(64) NodeChildren {
    Rectangles rectangles;
    float q[16];
};

/// The children that may concern the packet, as bits, empty slots among them.
HWY_INLINE std::uint32_t project_node(const PacketFrame& frame, const Node& node,
                                      NodeChildren& children) {
    const Floats f;
    std::uint32_t hits = 0;
    for (std::size_t l = 0; l < kWidth; l += hn::Lanes(f)) {
        const VF org[3] = {splat(frame.org.x), splat(frame.org.y), splat(frame.org.z)};
        const VF lower[3] = {hn::Sub(hn::LoadU(f, node.lower_x + l), org[0]),
                             hn::Sub(hn::LoadU(f, node.lower_y + l), org[1]),
                             hn::Sub(hn::LoadU(f, node.lower_z + l), org[2])};
        const VF upper[3] = {hn::Sub(hn::LoadU(f, node.upper_x + l), org[0]),
                             hn::Sub(hn::LoadU(f, node.upper_y + l), org[1]),
                             hn::Sub(hn::LoadU(f, node.upper_z + l), org[2])};
        VF largest = hn::Zero(f);
        for (int axis = 0; axis < 3; ++axis) {
            largest = hn::Max(largest, hn::Max(hn::Abs(lower[axis]), hn::Abs(upper[axis])));
        }
        VF least[3], most[3];
        for (int k = 0; k < 3; ++k)
            project_boxes(frame, k, lower, upper, largest, least[k], most[k]);
        const Mask keep = rectangle_of_box(frame, least, most, children.rectangles, l);
        hn::Store(nearest_q(hn::Sub(least[2], splat(frame.depth_error))), f, children.q + l);
        hits |= mask_bits(keep) << l;
    }
    return hits;
}

/// Asks for a child's memory, without a branch: of a leaf for its first lines twice.
HWY_INLINE void prefetch_child(const Bvh& bvh, std::uint32_t child) {
    constexpr std::size_t kCacheLine = 64;
    static_assert(sizeof(Leaf) <= sizeof(Node));
    const bool is_leaf = (child & kLeafBit) != 0;
    const char* const bytes = is_leaf
                                  ? reinterpret_cast<const char*>(&bvh.leaves[child & ~kLeafBit])
                                  : reinterpret_cast<const char*>(&bvh.nodes[child]);
    const char* const rest = bytes + (is_leaf ? 0 : sizeof(Leaf));
    for (std::size_t i = 0; i < sizeof(Leaf); i += kCacheLine) hwy::Prefetch(bytes + i);
    for (std::size_t i = 0; i < sizeof(Node) - sizeof(Leaf); i += kCacheLine)
        hwy::Prefetch(rest + i);
}

}  // namespace HWY_NAMESPACE
}  // namespace morphray::cpu
HWY_AFTER_NAMESPACE();

#endif
