// Vectors of rays against the triangles of a leaf: closest hits, then any hits.
//
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

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>

#include "common/interop/packet_bounds.h"
#include "cpu/simd/hit_rule-inl.h"
#include "cpu/single_ray/leaf_hit_rule-inl.h"
#include "cpu/single_ray/leaf_lanes-inl.h"
#include "cpu/single_ray/ray_stream-inl.h"

HWY_BEFORE_NAMESPACE();
namespace mray::cpu {
namespace HWY_NAMESPACE {
using namespace simd::HWY_NAMESPACE;

/// The vertices of a leaf as a vector of rays sees them, and a bound of the edge functions of all
/// its triangles.
struct ProjectedLeaf {
    FloatVec x[kLeafVertices];
    FloatVec y[kLeafVertices];
    FloatVec z[kLeafVertices];
    FloatVec bound;

    HWY_INLINE lanes::Float3 operator[](std::uint32_t i) const { return {x[i], y[i], z[i]}; }
};

/// project_vertices() by the coordinates of a vertex with rotated axes, rotated(xyz).
template <class Rotated, class Project>
HWY_INLINE FloatVec project_rotated_vertices(const Leaf& leaf, std::uint32_t count, Rotated rotated,
                                             Project project, const ProjectedLeaf& out) {
    FloatVec size = zero();
    for (std::uint32_t i = 0; i < count; ++i) {
        project(rotated(&leaf.vertex[i].x), i);
        size = max(size, lanes::projected_size(out[i]));
    }
    return size;
}

/// Calls project(v, i) for the first `count` vertices v of a leaf, after their axes were rotated
/// for the rays from `first` on. It must set vertex i of `out`. Returns the largest |x| + |y|.
template <class Project>
HWY_INLINE FloatVec project_vertices(const RayStream& stream, std::size_t first, const Leaf& leaf,
                                     std::uint32_t count, Project project,
                                     const ProjectedLeaf& out) {
    const UintVec axis = load(stream.axis + first);
    const std::uint32_t z = stream.axis[first];
    if (all(float_mask(axis == z))) {
        const std::uint32_t x = (z + 1) % 3, y = (z + 2) % 3;
        const auto rotated = [=](const float* v)
                                 HWY_ATTR { return lanes::Float3(vec3(v[x], v[y], v[z])); };
        return project_rotated_vertices(leaf, count, rotated, project, out);
    }
    const auto rotated = [&axis](const float* v) HWY_ATTR {
        return lanes::rotate_axes(lanes::Float3(vec3(v[0], v[1], v[2])), axis);
    };
    return project_rotated_vertices(leaf, count, rotated, project, out);
}

/// The leaf's triangles use only vertex slots below this.
HWY_INLINE std::uint32_t used_vertices(const Leaf& leaf, std::uint32_t triangle_count) {
    std::uint32_t last = 0;
    for (std::uint32_t i = 0; i < triangle_count; ++i) {
        const std::uint32_t local = leaf.vertex[i].corners;
        last = std::max({last, corner(local, 0), corner(local, 1), corner(local, 2)});
    }
    return last + 1;
}

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

/// A vector of rays from `first` on at a leaf.
struct LeafRays {
    std::size_t first;
    lanes::ShearedRay sheared;
    Mask active;
    FloatVec tnear;
    Crossing crossing;
};

/// Calls keep(hits, hit, prim_id) for the lanes that hit triangle i no later than tfar of their
/// rays; e has its fast edge functions u, v and w.
template <class Keep>
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
    const Mask hits = decide_hits(s, e, a.z, b.z, c.z, possible, rays.tnear, tfar,
                                  lanes::Float3(leaf_position(leaf, i, 0)),
                                  lanes::Float3(leaf_position(leaf, i, 1)),
                                  lanes::Float3(leaf_position(leaf, i, 2)), hit, rays.crossing);
    keep(hits, hit, leaf.prim_id[i]);
}

/// Calls keep(hits, hit, prim_id) for the triangles of a leaf that rays among `asked` (bits, from
/// `first` on) hit no later than tfar of their rays: lanes are rays.
template <class Keep>
HWY_INLINE void intersect_leaf_together(const RayStream& stream, std::size_t first,
                                        std::uint32_t asked, const float* tfar, const Leaf& leaf,
                                        Keep keep) {
    const std::uint32_t count = corner_triangle_count(leaf.vertex[0].corners);
    const LeafRays rays{first, sheared_rays(stream, first), mask_of(asked),
                        load(stream.tnear + first), stream.crossing};
    ProjectedLeaf points;
    const FloatVec size = project_vertices(
        stream, first, leaf, used_vertices(leaf, count),
        [&](const lanes::Float3& v, std::uint32_t i) HWY_ATTR {
            const lanes::Float3 p = lanes::project_rotated_fast(rays.sheared, v);
            points.x[i] = p.x;
            points.y[i] = p.y;
            points.z[i] = p.z;
        },
        points);
    points.bound = lanes::edge_bound(3.0f * size, most_depth(abs(rays.sheared.org.z)));
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
        intersect_triangle(rays, tfar, leaf, i, points, e, keep);
    }
}

/// The closest hits of the rays `asked` (bits, from `first` on) in a leaf.
HWY_INLINE void intersect_leaf_together(const RayStream& stream, std::size_t first,
                                        std::uint32_t asked, const Leaf& leaf,
                                        ClosestHits& closest) {
    intersect_leaf_together(stream, first, asked, closest.t, leaf,
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

// Any hits: for rays that have a leaf in common, such as ambient-occlusion rays around one place,
// this takes fewer instructions than one ray after the other (lab/notes/cpu_tracer.md).
//
// The filter: which rays may go through a triangle. Vertices are projected as in project_fast, but
// divided by dir.z: with slopes, x' = a.x - (dir.x / dir.z) a.z, fused or not. The bound of its
// edge functions, in the notation of docs/design/arithmetic.md, "Plain floats where they suffice",
// for x' and with e = 2^-24:
// 1. x' differs from x / dir.z, with x of `project`, by the sum of
//        2 e r          rounding of a.x and a.z
//        3.4 e r        the slope: 2.4 e of the reciprocal and e of the product
//        e r            its product with a.z, unless it is fused
//        e X            the difference
//        4 e X + 2^-62  error of `project`
//    so delta <= e (6.4 r + 5 X) + 2^-62 and terms 2^-19 as large, less than the
//    e (8 r + 5 X) + 2^-62 there.
// 2. Edge functions are computed with at most as many roundings. So each is within the bound
//    derived there of the exact one, divided by dir.z^2.
// 3. That bound grows with m and Z, so one for the whole leaf will do: m = 3 M with M the largest
//    |x'| + |y'| of its vertices, and Z the largest |z|.
// 4. x' is not on a grid, and a product may underflow by at most 2^-126. The bound is at least
//    2^-97 and has room for that.

/// The rays among `rays` (bits, from `first` on) that hit triangle i of the leaf.
HWY_NOINLINE inline std::uint32_t rays_hitting_triangle(const RayStream& stream, std::size_t first,
                                                        std::uint32_t rays, const Leaf& leaf,
                                                        std::uint32_t i) {
    lanes::TriangleHit hit;
    return bits_of(intersect_triangles(
        sheared_rays(stream, first), mask_of(rays), load(stream.tnear + first),
        load(stream.tfar + first), lanes::Float3(leaf_position(leaf, i, 0)),
        lanes::Float3(leaf_position(leaf, i, 1)), lanes::Float3(leaf_position(leaf, i, 2)), hit));
}

/// project_vertices() by slopes. Sets the bound, and returns the largest |z|.
HWY_INLINE FloatVec project_by_slopes(const RayStream& stream, std::size_t first, const Leaf& leaf,
                                      std::uint32_t count, ProjectedLeaf& out) {
    const FloatVec org_x = load(stream.sheared_org[0] + first);
    const FloatVec org_y = load(stream.sheared_org[1] + first);
    const FloatVec org_z = load(stream.sheared_org[2] + first);
    const FloatVec slope_x = load(stream.slope[0] + first);
    const FloatVec slope_y = load(stream.slope[1] + first);
    FloatVec depth = zero();
    // A returned Float3 would go through memory.
    const auto project = [&](const lanes::Float3& v, std::uint32_t i) HWY_ATTR {
        const FloatVec z = v.z - org_z;
        out.x[i] = neg_mul_add(slope_x, z, v.x - org_x);
        out.y[i] = neg_mul_add(slope_y, z, v.y - org_y);
        out.z[i] = z;
        depth = max(depth, abs(z));
    };
    const FloatVec size = project_vertices(stream, first, leaf, count, project, out);
    out.bound = lanes::edge_bound(3.0f * size, depth);
    return depth;
}

/// The rays among `rays` (bits) that hit a triangle of the leaf.
HWY_INLINE std::uint64_t rays_hitting(const RayStream& stream, std::uint64_t rays,
                                      const Leaf& leaf) {
    const std::uint32_t count = corner_triangle_count(leaf.vertex[0].corners);
    const std::uint32_t vertex_count = used_vertices(leaf, count);
    std::uint64_t hits = 0;
    for (std::size_t first = 0; first < kStreamRays; first += kLanes) {
        auto left = static_cast<std::uint32_t>(rays >> first & kLaneBits);
        if (left == 0) continue;
        ProjectedLeaf p;
        const FloatVec largest_z = project_by_slopes(stream, first, leaf, vertex_count, p);
        const FloatVec dz = load(stream.sheared_dir[2] + first);
        const CertainRange range = certain_ranges(stream, first);
        for (std::uint32_t i = 0; i < count && left != 0; ++i) {
            const std::uint32_t local = leaf.vertex[i].corners;
            const std::uint32_t a = corner(local, 0);
            const std::uint32_t b = corner(local, 1);
            const std::uint32_t c = corner(local, 2);
            const auto edge = [&p](std::uint32_t i0, std::uint32_t i1) {
                return mul_sub(p.x[i0], p.y[i1], p.y[i0] * p.x[i1]);
            };
            const FloatVec u = edge(b, c), v = edge(c, a), w = edge(a, b);
            const Mask inside = (min3(u, v, w) >= -p.bound) | (max3(u, v, w) <= p.bound);
            std::uint32_t possible = bits_of(inside) & left;
            if (possible == 0) continue;
            if (finite_coordinates(leaf.vertex[a].x, leaf.vertex[b].x, leaf.vertex[c].x)) {
                const FloatVec za = p.z[a], zb = p.z[b], zc = p.z[c];
                const FloatVec range_of_z = max3(za, zb, zc) - min3(za, zb, zc);
                const lanes::Edges e{u, v, w, p.bound, range_of_z, largest_z};
                const DepthSum depth = depth_sum(e, za, zb, zc, dz);
                const std::uint32_t certain =
                    bits_of(certain_occluders(e, depth, range)) & possible;
                hits |= std::uint64_t{certain} << first;
                left &= ~certain;
                possible &= ~certain & bits_of(and_not(certainly_beyond(e, depth, range),
                                                       may_be_ahead(e, depth)));
                if (possible == 0) continue;
            }
            if (has_equal_corners(leaf, i)) continue;
            const std::uint32_t hit = rays_hitting_triangle(stream, first, possible, leaf, i);
            hits |= std::uint64_t{hit} << first;
            left &= ~hit;
        }
    }
    return hits;
}

}  // namespace HWY_NAMESPACE
}  // namespace mray::cpu
HWY_AFTER_NAMESPACE();

#endif  // per target
