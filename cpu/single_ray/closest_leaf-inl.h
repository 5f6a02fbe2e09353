// Closest hits in a leaf, for one ray or for a vector of rays, by the hit rule and with its bits.
//
// Many rays: the leaf's vertices are projected once for a vector of rays, by the rule's fast path,
// and serve all triangles. A triangle is skipped by the edge functions of the rule and one bound
// for the leaf, 3 times the largest |x| + |y| of its vertices in place of the sum over a
// triangle's, and most_depth() in place of the largest |z|. Each operation of edge_bound is
// monotone and 2 M is exact, so this bound is not below a triangle's own, bit for bit.
#if defined(MORPHRAY_CPU_SINGLE_RAY_CLOSEST_LEAF_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef MORPHRAY_CPU_SINGLE_RAY_CLOSEST_LEAF_INL_H
#undef MORPHRAY_CPU_SINGLE_RAY_CLOSEST_LEAF_INL_H
#else
#define MORPHRAY_CPU_SINGLE_RAY_CLOSEST_LEAF_INL_H
#endif

#include <bit>
#include <cstddef>
#include <cstdint>

#include "cpu/simd/hit_rule-inl.h"
#include "cpu/single_ray/leaf_hit_rule-inl.h"
#include "cpu/single_ray/leaf_lanes-inl.h"
#include "cpu/single_ray/ray_stream-inl.h"
#include "cpu/single_ray/shared_leaf-inl.h"

HWY_BEFORE_NAMESPACE();
namespace mray::cpu {
namespace HWY_NAMESPACE {
using namespace simd::HWY_NAMESPACE;

/// The closest hits of a stream so far: t is tfar and prim_id kNoPrim before the first one; `last`
/// is last_depth of t. Lanes that hold no ray have -1 for both, so that they meet nothing.
struct alignas(64) ClosestHits {
    float t[kStreamRays];
    float last[kStreamRays];
    float u[kStreamRays];
    float v[kStreamRays];
    std::uint32_t prim_id[kStreamRays];

    /// For the first `count` rays.
    HWY_INLINE ClosestHits(const RayStream& stream, std::size_t count) {
        for (std::size_t i = 0; i < count; i += kLanes) {
            const auto used = hn::FirstN(kFloats, count - i);
            store(select(used, load(stream.tfar + i), -1.0f), t + i);
            store(select(used, load(stream.last_depth + i), -1.0f), last + i);
            store(zero(), u + i);
            store(zero(), v + i);
            store(splat(kNoPrim), prim_id + i);
        }
        const std::size_t rest = (count + kLanes - 1) / kLanes * kLanes;
        for (std::size_t i = rest; i < kStreamRays; i += kLanes) {
            store(splat(-1.0f), t + i);
            store(splat(-1.0f), last + i);
        }
    }

    ClosestHits() = default;

    HWY_INLINE Hit hit(std::size_t ray) const {
        const bool is_hit = prim_id[ray] != kNoPrim;
        return is_hit ? Hit{t[ray], u[ray], v[ray], prim_id[ray]} : no_hit();
    }

    /// Keeps those of the hits of triangle `id` (lanes are the rays from `first` on) that are
    /// closer, by is_closer.
    HWY_INLINE void keep_closer(std::size_t first, Mask hits, const lanes::TriangleHit& hit,
                                std::uint32_t id) {
        const FloatVec old_t = load(t + first);
        const UintVec old_id = load(prim_id + first);
        const UintVec new_id = splat(id);
        const Mask is_smaller = float_mask(new_id < old_id);
        const Mask closer = hits & ((hit.t < old_t) | ((hit.t == old_t) & is_smaller));
        const FloatVec new_last = lanes::last_depth(hit.t);
        store(select(closer, hit.t, old_t), t + first);
        store(select(closer, new_last, load(last + first)), last + first);
        store(select(closer, hit.u, load(u + first)), u + first);
        store(select(closer, hit.v, load(v + first)), v + first);
        store(select(uint_mask(closer), new_id, old_id), prim_id + first);
    }
};

/// The closest hit of a ray in a leaf: lanes are triangles. kAxis is the ray's main axis, or
/// kAnyAxis.
template <int kAxis = kAnyAxis>
HWY_INLINE void intersect_leaf_alone(const RayStream& stream, std::size_t ray, const Leaf& leaf,
                                     ClosestHits& closest) {
    intersect_leaf<kAxis>(stream, ray, closest.t[ray], leaf,
                          [&](std::uint32_t slot, const TriangleHit& hit) {
                              const std::uint32_t id = leaf.prim_id[slot];
                              if (is_closer(hit.t, id, closest.t[ray], closest.prim_id[ray])) {
                                  closest.t[ray] = hit.t;
                                  closest.last[ray] = last_depth(hit.t);
                                  closest.u[ray] = hit.u;
                                  closest.v[ray] = hit.v;
                                  closest.prim_id[ray] = id;
                              }
                              return false;
                          });
}

/// The vertices of a leaf as the rule's fast path sees them (project_fast), and a bound of the edge
/// functions of all its triangles.
struct ProjectedLeaf {
    FloatVec x[kLeafVertices];
    FloatVec y[kLeafVertices];
    FloatVec z[kLeafVertices];
    FloatVec bound;

    HWY_INLINE lanes::Float3 operator[](std::uint32_t i) const { return {x[i], y[i], z[i]}; }
};

/// Projects the first `count` vertices. rotated(xyz) are a vertex's coordinates with rotated axes.
template <class Rotated>
HWY_INLINE void project_vertices(const lanes::ShearedRay& s, const Leaf& leaf, std::uint32_t count,
                                 Rotated rotated, ProjectedLeaf& out) {
    FloatVec size = zero();
    for (std::uint32_t i = 0; i < count; ++i) {
        const lanes::Float3 p = lanes::project_rotated_fast(s, rotated(&leaf.vertex[i].x));
        out.x[i] = p.x;
        out.y[i] = p.y;
        out.z[i] = p.z;
        size = max(size, lanes::projected_size(p));
    }
    out.bound = lanes::edge_bound(3.0f * size, most_depth(abs(s.org.z)));
}

HWY_INLINE void project_leaf(const lanes::ShearedRay& s, std::uint32_t first_axis, const Leaf& leaf,
                             std::uint32_t count, ProjectedLeaf& out) {
    if (all(float_mask(s.axis == first_axis))) {
        const std::uint32_t x = (first_axis + 1) % 3, y = (first_axis + 2) % 3, z = first_axis;
        const auto rotated = [=](const float* v)
                                 HWY_ATTR { return lanes::Float3(vec3(v[x], v[y], v[z])); };
        project_vertices(s, leaf, count, rotated, out);
    } else {
        const auto rotated = [&s](const float* v) HWY_ATTR {
            return lanes::rotate_axes(lanes::Float3(vec3(v[0], v[1], v[2])), s.axis);
        };
        project_vertices(s, leaf, count, rotated, out);
    }
}

/// A vector of rays from `first` on at a leaf.
struct LeafRays {
    std::size_t first;
    lanes::ShearedRay sheared;
    Mask active;
    FloatVec tnear;
};

/// Calls keep(hits, hit, prim_id) for the lanes that hit triangle i no later than tfar of their
/// rays; e has its fast edge functions u, v and w.
template <Crossing kCrossing, class Keep>
HWY_INLINE void intersect_triangle(const LeafRays& rays, const float* tfar_of_rays,
                                   const Leaf& leaf, std::uint32_t i, const ProjectedLeaf& points,
                                   lanes::Edges e, Keep keep) {
    if (has_equal_corners(leaf, i)) return;
    const std::uint32_t local = leaf.vertex[i].corners;
    const lanes::ShearedRay& s = rays.sheared;
    const lanes::Float3 a = points[corner(local, 0)];
    const lanes::Float3 b = points[corner(local, 1)];
    const lanes::Float3 c = points[corner(local, 2)];
    const FloatVec m =
        sum3(lanes::projected_size(a), lanes::projected_size(b), lanes::projected_size(c));
    lanes::measure_depth(a.z, b.z, c.z, e);
    e.bound = lanes::edge_bound(m, e.depth_size);
    const DepthSum depth = depth_sum(e, a.z, b.z, c.z, s.dir.z);
    const Mask possible = rays.active & lanes::may_be_inside(e) & may_be_ahead(e, depth);
    if (none(possible)) return;
    const FloatVec tfar = load(tfar_of_rays + rays.first);
    lanes::TriangleHit hit;
    const Mask is_certain = lanes::weighted_hit(s, e, a.z, b.z, c.z, hit);
    const Mask is_hit = lanes::surely_inside(s, e) & is_certain;
    Mask hits = possible & is_hit & lanes::is_in_range(hit.t, rays.tnear, tfar);
    const Mask uncertain = and_not(is_hit, possible);
    const lanes::Float3 va(leaf_position(leaf, i, 0));
    const lanes::Float3 vb(leaf_position(leaf, i, 1));
    const lanes::Float3 vc(leaf_position(leaf, i, 2));
    if (!none(uncertain)) {
        lanes::TriangleHit exact;
        const Mask exact_hits = intersect_exactly<kCrossing>(
            s, rays.tnear, tfar, lanes::rotate_axes(va, s.axis), lanes::rotate_axes(vb, s.axis),
            lanes::rotate_axes(vc, s.axis), exact);
        hits = hits | (uncertain & exact_hits);
        hit.t = select(uncertain, exact.t, hit.t);
        hit.u = select(uncertain, exact.u, hit.u);
        hit.v = select(uncertain, exact.v, hit.v);
    }
    keep(hits & lanes::finite_vertices(va, vb, vc), hit, leaf.prim_id[i]);
}

/// Calls keep(hits, hit, prim_id) for the triangles of a leaf that rays among `asked` (bits, from
/// `first` on) hit no later than tfar of their rays: lanes are rays.
template <Crossing kCrossing, class Keep>
HWY_INLINE void intersect_leaf_together(const RayStream& stream, std::size_t first,
                                        std::uint32_t asked, const float* tfar, const Leaf& leaf,
                                        Keep keep) {
    const std::uint32_t count = corner_triangle_count(leaf.vertex[0].corners);
    const LeafRays rays{first, sheared_rays(stream, first), mask_of(asked),
                        load(stream.tnear + first)};
    ProjectedLeaf points;
    project_leaf(rays.sheared, stream.axis[first], leaf, used_vertices(leaf, count), points);
    for (std::uint32_t i = 0; i < count; ++i) {
        const std::uint32_t local = leaf.vertex[i].corners;
        const lanes::Float3 a = points[corner(local, 0)];
        const lanes::Float3 b = points[corner(local, 1)];
        const lanes::Float3 c = points[corner(local, 2)];
        lanes::Edges e;
        e.u = lanes::fast_edge(b, c);
        e.v = lanes::fast_edge(c, a);
        e.w = lanes::fast_edge(a, b);
        e.bound = points.bound;
        if (none(lanes::may_be_inside(e) & rays.active)) continue;
        intersect_triangle<kCrossing>(rays, tfar, leaf, i, points, e, keep);
    }
}

/// The closest hits of the rays `asked` (bits, from `first` on) in a leaf.
HWY_INLINE void intersect_leaf_together(const RayStream& stream, std::size_t first,
                                        std::uint32_t asked, const Leaf& leaf,
                                        ClosestHits& closest) {
    intersect_leaf_together<Crossing::kEach>(
        stream, first, asked, closest.t, leaf,
        [&](Mask hits, const lanes::TriangleHit& hit, std::uint32_t prim_id)
            HWY_ATTR { closest.keep_closer(first, hits, hit, prim_id); });
}

// A vector of rays is tested together if it has more than this many of those at a leaf
// (lab/notes/cpu_tracer.md has the figures).
inline constexpr std::size_t kTogetherInLeaf = kLanes < 8 ? kLanes / 2 + 1 : kLanes == 8 ? 3 : 6;

/// Calls together(first, asked) for the vectors with many of these rays (bits), alone(ray) for the
/// rays of others.
template <class Together, class Alone>
HWY_INLINE void for_rays_of_leaf(std::uint64_t rays, Together together, Alone alone) {
    for (std::size_t first = 0; first < kStreamRays; first += kLanes) {
        auto asked = static_cast<std::uint32_t>(rays >> first & kLaneBits);
        if (static_cast<std::size_t>(std::popcount(asked)) > kTogetherInLeaf) {
            together(first, asked);
            continue;
        }
        for (; asked != 0; asked &= asked - 1)
            alone(first + static_cast<std::size_t>(std::countr_zero(asked)));
    }
}

}  // namespace HWY_NAMESPACE
}  // namespace mray::cpu
HWY_AFTER_NAMESPACE();

#endif  // per target
