// The plane of a packet: rectangles in it; the frame; wedges, planes that bound all rays in scene
// space; the boxes of a node in it; and the traversal of the tree, nearest boxes first.
#if defined(MORPHRAY_CPU_PACKET_PACKET_PLANE_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef MORPHRAY_CPU_PACKET_PACKET_PLANE_INL_H
#undef MORPHRAY_CPU_PACKET_PACKET_PLANE_INL_H
#else
#define MORPHRAY_CPU_PACKET_PACKET_PLANE_INL_H
#endif

#include <algorithm>
#include <cassert>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "common/bvh/bvh.h"
#include "common/interop/packet_bounds.h"
#include "cpu/packet/packets.h"
#include "cpu/simd/hit_rule-inl.h"
#include "cpu/simd/node-inl.h"

HWY_BEFORE_NAMESPACE();
namespace mray::cpu::HWY_NAMESPACE {

/// Rectangles in the packet's plane, one a lane.
struct RectangleLanes {
    FloatVec lower_x, upper_x, lower_y, upper_y;

    HWY_INLINE RectangleLanes(FloatVec left, FloatVec right, FloatVec low, FloatVec high)
        : lower_x(left), upper_x(right), lower_y(low), upper_y(high) {}
    HWY_INLINE explicit RectangleLanes(const PlaneRectangle& r)
        : RectangleLanes(splat(r.lower_x), splat(r.upper_x), splat(r.lower_y), splat(r.upper_y)) {}
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
        return ((lower_x <= r.upper_x) & (upper_x >= r.lower_x)) &
               ((lower_y <= r.upper_y) & (upper_y >= r.lower_y));
    }
    HWY_INLINE Mask holds(FloatVec x, FloatVec y) const {
        return ((x >= lower_x) & (x <= upper_x)) & ((y >= lower_y) & (y <= upper_y));
    }
};

static_assert(kWidth == kLeafTriangles);
using Rectangles = PlaneRectangles<kWidth>;

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
HWY_INLINE void reduce_four(const FloatVec vectors[4], [[maybe_unused]] Combine combine,
                            float* out) {
#if HWY_TARGET == HWY_SCALAR
    for (std::size_t i = 0; i < 4; ++i) out[i] = hn::GetLane(vectors[i]);
#else
    hn::Store(reduce_blocks(kFloats, combine_four(vectors, combine), combine), hn::Full128<float>(),
              out);
#endif
}

// ---- The frame

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

// ---- Wedges exclude boxes that the sides of the packet's rectangle do not, above all boxes
// that reach behind the origin beside the rays. A box and a cone of rays may be separated only by a
// plane parallel to an edge of the box that holds an edge of the cone (S. Gottschalk, M. Lin, D.
// Manocha. OBBTree: a hierarchical structure for rapid interference detection. 1996, section 5).

/// Whether a frame's rows, found in double, are the inverse of its axes but for 2^-18, and its
/// corners, in double, exact enough for the margin of wedges.
HWY_INLINE bool may_have_wedges(const PacketFrame& frame, const PlaneAxes& axes) {
    const auto size = [](const glm::dvec3& axis) {
        return std::max({std::abs(axis.x), std::abs(axis.y), std::abs(axis.z)});
    };
    const double span = glm::dot(axes.x, glm::cross(axes.y, axes.z));
    return std::abs(span) > kLeastWedgeSpan * size(axes.x) * size(axes.y) * size(axes.z) &&
           frame.depth_most <= kMostWedgeDepths * frame.depth_least;
}

/// Sets the wedges of a frame whose rays go through its bounds of x and y. Every direction is a
/// mean of those through the four corners, so all rays are on a side of a plane where these are.
/// Seen along an axis, the plane through the outermost corner on each side is such a plane, or none
/// is.
HWY_INLINE void set_wedges(PacketFrame& frame, const PlaneAxes& axes) {
    if (!may_have_wedges(frame, axes)) return;
    glm::dvec3 corner[4];
    for (int k = 0; k < 4; ++k) {
        const double x = (k & 1) != 0 ? frame.upper_x : frame.lower_x;
        const double y = (k & 2) != 0 ? frame.upper_y : frame.lower_y;
        corner[k] = axes.x * x + axes.y * y + axes.z;
    }
    for (int axis = 0; axis < 3; ++axis) {
        const int u = (axis + 1) % 3;
        const int v = (axis + 2) % 3;
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
            plane.axes[0] = static_cast<std::uint32_t>(u);
            plane.axes[1] = static_cast<std::uint32_t>(v);
            plane.normal[0] = static_cast<float>(-side * corner[outermost][v] / size);
            plane.normal[1] = static_cast<float>(side * corner[outermost][u] / size);
        }
    }
}

/// The boxes, with bounds relative to the origin, that are outside a wedge, so that no ray of the
/// packet meets them (lab/proofs/packet_rectangles.g). size: the largest coordinate of each box.
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

// ---- The boxes of a node

/// Sets the least and the greatest value of row k of the projection over boxes relative to the
/// origin. size: the largest coordinate of each box. kBoxError covers what is rounded here and how
/// far displaced triangles reach out of their box (docs/design/arithmetic.md, "Packets", step 5).
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
/// them the packet may meet. Boxes that are not in front of the origin have bounds on one side, or
/// none (docs/design/arithmetic.md, "Packets", step 5).
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
    RectangleLanes(low(least[0]), high(most[0]), low(least[1]), high(most[1])).put(r, l);
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
    PerSlot<float> q;
};

/// Projects a node's children. Returns those that the packet may meet, as bits.
///
/// These are never empty slots, whose boxes are inverted by 2^48 on all axes, far beyond |org| <=
/// 2^40: `most` of z adds products of 0 or less, and its error is at most 2^-19 of them.
HWY_INLINE std::uint32_t project_node(const PacketFrame& frame, const Node& node,
                                      NodeChildren& children) {
    std::uint32_t hits = 0;
    for (std::size_t l = 0; l < kWidth; l += kLanes) {
        FloatVec lower[3], upper[3], largest = zero();
        for (std::uint32_t axis = 0; axis < 3; ++axis) {
            const FloatVec org = splat(frame.org[static_cast<int>(axis)]);
            lower[axis] = planes_of(node, axis, 0, l) - org;
            upper[axis] = planes_of(node, axis, 1, l) - org;
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

// ---- The traversal
//
// Based on: I. Wald, S. Boulos, P. Shirley. Ray Tracing Deformable Scenes Using Dynamic Bounding
// Volume Hierarchies. ACM TOG 26(1), 2007: packets far larger than a vector, one conservative test
// of the whole packet per node, ordered descent. Changed: sixteen children are tested at once in
// the packet's own projection; the active rays are a mask of blocks; and triangles are set up
// sixteen at a time as homogeneous edge functions (M. Olano, T. Greer. Triangle scan conversion
// using 2D homogeneous coordinates. 1997), so that nothing needs clipping.
//
// Edge functions and 1/z decide only beyond a bound of their distance from what the hit rule
// computes, and the rule resolves the rest. So any arithmetic may be used, fused or not.

/// Prefetches a child's memory without a branch: a leaf's first lines are prefetched twice.
HWY_INLINE void prefetch_child(const Bvh& bvh, std::uint32_t child) {
    static_assert(sizeof(Leaf) <= sizeof(Node));
    const char* const bytes = is_leaf(child)
                                  ? reinterpret_cast<const char*>(&bvh.leaves[leaf_of(child)])
                                  : reinterpret_cast<const char*>(&bvh.nodes[child]);
    prefetch(bytes, sizeof(Leaf));
    prefetch(bytes + (is_leaf(child) ? 0 : sizeof(Leaf)), sizeof(Node) - sizeof(Leaf));
}

/// Traverses the tree with a packet. `Tracer` holds the packet and has
///
///     ActiveRays        the rays of the packet that a box may concern
///     frame()           the packet's frame
///     narrow(q, is_node, active)
///                       removes rays that no hit with 1/z <= q concerns. Returns whether any
///                       remain
///     find_active(children, slots, active, active_at)
///                       sets active_at[slot] to the active rays of each child in `slots`. Returns
///                       the slots that have any
///     visit_leaf(leaf, q, active)
///                       tests a leaf, whose box is no nearer than q (nearest_q). Returns false to
///                       end the traversal
template <class Tracer>
class alignas(kPage) PacketTraversal {
public:
    using ActiveRays = typename Tracer::ActiveRays;

    PacketTraversal(const Bvh& bvh, Tracer& tracer) : bvh_(bvh), tracer_(tracer) {}

    /// Visits the root with all rays. Returns whether it has children that the packet may hit.
    bool start(const ActiveRays& all) {
        visit_node(bvh_.nodes[0], all);
        return size_ > 0;
    }

    /// Visits what start() found. Returns false if visit_leaf() ended the traversal.
    bool run() {
        while (size_ > 0) {
            const Entry& top = stack_[--size_];
            const float q = top.q;
            const std::uint32_t child = top.child;
            ActiveRays active = top.active;
            const bool is_node = !is_leaf(child);
            if (!tracer_.narrow(q, is_node, active)) continue;
            if (is_node) {
                visit_node(bvh_.nodes[child], active);
            } else if (!tracer_.visit_leaf(bvh_.leaves[leaf_of(child)], q, active)) {
                return false;
            }
        }
        return true;
    }

private:
    /// A child to visit: its box is seen no nearer than q (nearest_q).
    struct Entry {
        ActiveRays active;
        float q;
        std::uint32_t child;
    };

    void visit_node(const Node& node, const ActiveRays& active) {
        NodeChildren children;
        const std::uint32_t hits = project_node(tracer_.frame(), node, children);
        PerSlot<ActiveRays> active_at;
        const std::uint32_t kept = tracer_.find_active(children, hits, active, active_at);
        alignas(64) PerSlot<std::int32_t> order;
        order_of(children.q, order);
        for (const std::uint32_t slot : BitsOf(kept)) {
            assert(child_of(node, slot) != kEmptyChild);
            stack_[size_ + hwy::PopCount(kept & slots_before(order, order[slot]))] = {
                active_at[slot], children.q[slot], child_of(node, slot)};
            prefetch_child(bvh_, child_of(node, slot));
        }
        size_ += static_cast<std::uint32_t>(hwy::PopCount(kept));
    }

    /// Sets distinct numbers in the order of 1/z except for its last 4 bits: the bits of floats
    /// that are not negative, with the slot in the last bits.
    static HWY_INLINE void order_of(const float* q, std::int32_t* order) {
        for (std::size_t l = 0; l < kWidth; l += kLanes) {
            const auto bits = as_int(load(q + l));
            const auto slots = hn::Iota(kInts, static_cast<std::int32_t>(l));
            store((bits & splat(~15)) | slots, order + l);
        }
    }

    /// The children whose order is less than `own`: those farther away.
    static HWY_INLINE std::uint32_t slots_before(const std::int32_t* order, std::int32_t own) {
        return bits_of_sixteen([&](std::size_t l)
                                   HWY_ATTR { return float_mask(load(order + l) < splat(own)); });
    }

    const Bvh& bvh_;
    Tracer& tracer_;
    std::uint32_t size_ = 0;
    TraversalStack<Entry> stack_;
};

}  // namespace mray::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per target
