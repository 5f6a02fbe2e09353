// Points near each other, one in each lane.
#if defined(MORPHRAY_CPU_QUERIES_POINTS_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef MORPHRAY_CPU_QUERIES_POINTS_INL_H
#undef MORPHRAY_CPU_QUERIES_POINTS_INL_H
#else
#define MORPHRAY_CPU_QUERIES_POINTS_INL_H
#endif

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>

#include "common/bvh/bvh.h"
#include "common/scene_queries.h"
#include "common/simd/vectors-inl.h"
#include "cpu/queries/tree_queries.h"
#include "cpu/simd/lanes-inl.h"
#include "cpu/single_ray/leaf_hit_rule-inl.h"
#include "cpu/single_ray/leaf_lanes-inl.h"
#include "cpu/single_ray/node_lanes-inl.h"
#include "cpu/single_ray/walks-inl.h"

HWY_BEFORE_NAMESPACE();
namespace mray::cpu {
namespace HWY_NAMESPACE {
using namespace simd::HWY_NAMESPACE;

#if HWY_TARGET != HWY_SCALAR

/// At most kLanes points, and the corners of their box in all lanes. Lanes without a point have the
/// last one.
struct PointLanes {
    lanes::Float3 p;
    lanes::Float3 lower;
    lanes::Float3 upper;

    HWY_INLINE explicit PointLanes(std::span<const vec3> points) {
        HWY_ALIGN float values[3][kLanes];
        for (std::size_t i = 0; i < kLanes; ++i) {
            const vec3& point = points[std::min(i, points.size() - 1)];
            for (int axis = 0; axis < 3; ++axis) values[axis][i] = point[axis];
        }
        p = {load(values[0]), load(values[1]), load(values[2])};
        lower = {hn::MinOfLanes(kFloats, p.x), hn::MinOfLanes(kFloats, p.y),
                 hn::MinOfLanes(kFloats, p.z)};
        upper = {hn::MaxOfLanes(kFloats, p.x), hn::MaxOfLanes(kFloats, p.y),
                 hn::MaxOfLanes(kFloats, p.z)};
    }
};

#endif  // HWY_TARGET

// Points against nodes and leaves, with the 16 boxes or triangles for lanes: windings and closest
// triangles. Control flow alone; all arithmetic is the shared text of the rules.

// ---- Boxes and triangles

struct BoxLanes {
    lanes::Float3 lower;
    lanes::Float3 upper;
};

/// Vector v of the boxes of a node.
HWY_INLINE BoxLanes load_boxes(const Node& node, std::size_t v) {
    const std::size_t i = v * kLanes;
    return {{load_unaligned(node.lower_x + i), load_unaligned(node.lower_y + i),
             load_unaligned(node.lower_z + i)},
            {load_unaligned(node.upper_x + i), load_unaligned(node.upper_y + i),
             load_unaligned(node.upper_z + i)}};
}

/// The boxes of triangles.
HWY_INLINE BoxLanes boxes_of(const lanes::Float3& a, const lanes::Float3& b,
                             const lanes::Float3& c) {
    return {lanes::lesser3(a, lanes::lesser3(b, c)), lanes::greater3(a, lanes::greater3(b, c))};
}

/// The slots whose boxes meet(boxes) has, as bits.
template <class Meet>
HWY_INLINE std::uint32_t slots_of(const Node& node, Meet meet) {
    std::uint32_t slots = 0;
    for (std::size_t v = 0; v < kVectors; ++v)
        slots |= bits_of(meet(load_boxes(node, v))) << (v * kLanes);
    return slots;
}

/// The slots whose boxes are no farther than `most_d2` by distance2(boxes), as bits; stores the
/// distances of all.
template <class Distance2>
HWY_INLINE std::uint32_t slots_within(const Node& node, FloatVec most_d2, Distance2 distance2,
                                      float* HWY_RESTRICT d2) {
    std::uint32_t slots = 0;
    for (std::size_t v = 0; v < kVectors; ++v) {
        const FloatVec distances2 = distance2(load_boxes(node, v));
        store(distances2, d2 + v * kLanes);
        slots |= bits_of(distances2 <= most_d2) << (v * kLanes);
    }
    return slots;
}

#if HWY_TARGET == HWY_SCALAR

/// Calls visit(lanes of slots, a, b, c) for the triangles with finite vertices, one a time.
template <class Visit>
HWY_INLINE void for_each_triangle(const Leaf& leaf, Visit visit) {
    const std::uint32_t count = corner_triangle_count(leaf.vertex[0].corners);
    for (std::uint32_t slot = 0; slot < count; ++slot) {
        const vec3 a = leaf_position(leaf, slot, 0);
        const vec3 b = leaf_position(leaf, slot, 1);
        const vec3 c = leaf_position(leaf, slot, 2);
        if (!finite_vertices(a, b, c)) continue;
        visit([slot](std::uint32_t) { return slot; }, mask_of(1), lanes::Float3(a),
              lanes::Float3(b), lanes::Float3(c));
    }
}

#else

/// Calls visit(slot_of, mask, a, b, c) for each vector of triangles: lane i of those in the mask
/// holds the triangle in slot_of(i), whose vertices are finite.
template <class Visit>
HWY_INLINE void for_each_triangle(const Leaf& leaf, Visit visit) {
    const LeafLanes vertices = load_leaf<2>(leaf, 2);
    VertexValues x, y, z;
    for (std::size_t v = 0; v < kVectors; ++v) {
        x.set(v, vertices.x[v]);
        y.set(v, vertices.y[v]);
        z.set(v, vertices.z[v]);
    }
    for (std::size_t v = 0; v < kVectors; ++v) {
        const VertexLookups at(vertices.local_vertices[v]);
        const auto position = [&](const LaneLookup& places) HWY_ATTR {
            return lanes::Float3(x.look_up(places), y.look_up(places), z.look_up(places));
        };
        const lanes::Float3 a = position(at.a);
        const lanes::Float3 b = position(at.b);
        const lanes::Float3 c = position(at.c);
        const Mask used =
            used_lanes(vertices.local_vertices[v], v) & lanes::finite_vertices(a, b, c);
        const auto slot_of = [v](std::uint32_t lane) {
            return slot_of_lane(static_cast<std::uint32_t>(v * kLanes) + lane);
        };
        if (!none(used)) visit(slot_of, used, a, b, c);
    }
}

#endif  // HWY_TARGET

// ---- Windings

/// Counts the crossings of a point with a leaf's triangles; uncertain(prim_id) is called for those
/// that floats cannot decide on.
template <class Uncertain>
HWY_INLINE void wind_around_leaf(const Bvh& bvh, const Leaf& leaf, const lanes::Float3& p,
                                 FloatWinding& winding, Uncertain uncertain) {
    for_each_triangle(leaf, [&](auto slot_of, Mask used, const lanes::Float3& a,
                                const lanes::Float3& b, const lanes::Float3& c) HWY_ATTR {
        const lanes::FloatCrossing crossing = lanes::float_crossing(p, a, b, c);
        const auto for_each_prim = [&](Mask of, auto visit) HWY_ATTR {
            for (std::uint32_t bits = bits_of(of & used); bits != 0; bits &= bits - 1) {
                const auto lane = static_cast<std::uint32_t>(std::countr_zero(bits));
                const std::uint32_t prim_id = leaf.prim_id[slot_of(lane)];
                visit(prim_id);
                for (const RepeatedTriangle& repeat : repeats_of(bvh, prim_id))
                    visit(repeat.prim_id);
            }
        };
        if (bvh.repeated.empty()) [[likely]] {
            const auto up = static_cast<std::int32_t>(count(crossing.is_up & used));
            const auto down = static_cast<std::int32_t>(count(crossing.is_down & used));
            winding.winding += up - down;
            winding.crossings += static_cast<std::uint32_t>(up + down);
        } else {
            for_each_prim(crossing.is_up, [&](std::uint32_t) {
                ++winding.winding;
                ++winding.crossings;
            });
            for_each_prim(crossing.is_down, [&](std::uint32_t) {
                --winding.winding;
                ++winding.crossings;
            });
        }
        for_each_prim(crossing.is_uncertain, uncertain);
    });
}

/// Adds the number of leaves visited to `leaves`.
template <class Uncertain>
HWY_INLINE FloatWinding wind_around(const Bvh& bvh, vec3 point, std::size_t& leaves,
                                    Uncertain uncertain) {
    FloatWinding winding;
    const lanes::Float3 p(clipped_point(point));
    const auto met = [&](const Node& node) HWY_ATTR {
        return slots_of(node, [&](const BoxLanes& boxes) HWY_ATTR {
            return lanes::may_cross_in(p, boxes.lower, boxes.upper);
        });
    };
    for_each_leaf(bvh, met, [&](const Leaf& leaf) HWY_ATTR {
        ++leaves;
        wind_around_leaf(bvh, leaf, p, winding, uncertain);
        return true;
    });
    return winding;
}

}  // namespace HWY_NAMESPACE
}  // namespace mray::cpu
HWY_AFTER_NAMESPACE();

#endif  // per target
