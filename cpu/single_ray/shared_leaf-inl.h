// Many rays against the triangles of a leaf: lanes are rays. For rays that have a leaf in common,
// such as ambient-occlusion rays around one place, this takes fewer instructions than one ray after
// the other (lab/notes/cpu_tracer.md).
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
#if defined(MORPHRAY_CPU_SINGLE_RAY_SHARED_LEAF_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef MORPHRAY_CPU_SINGLE_RAY_SHARED_LEAF_INL_H
#undef MORPHRAY_CPU_SINGLE_RAY_SHARED_LEAF_INL_H
#else
#define MORPHRAY_CPU_SINGLE_RAY_SHARED_LEAF_INL_H
#endif

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "common/interop/packet_bounds.h"
#include "cpu/simd/hit_rule-inl.h"
#include "cpu/single_ray/certain_occluders-inl.h"
#include "cpu/single_ray/leaf_lanes-inl.h"
#include "cpu/single_ray/ray_stream-inl.h"

HWY_BEFORE_NAMESPACE();
namespace mray::cpu {
namespace HWY_NAMESPACE {
using namespace simd::HWY_NAMESPACE;

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

/// The projected vertices of a leaf for a vector of rays, the bound of the edge functions and the
/// largest |z|.
struct SharedPoints {
    FloatVec x[kLeafVertices];
    FloatVec y[kLeafVertices];
    FloatVec z[kLeafVertices];
    FloatVec bound;
    FloatVec depth;
};

/// Projects the first `count` vertices for the rays from `first` on. rotated(xyz) are a vertex's
/// coordinates with rotated axes.
template <class Rotated>
HWY_INLINE void project_rotated_shared(const RayStream& stream, std::size_t first, const Leaf& leaf,
                                       std::uint32_t count, Rotated rotated, SharedPoints& points) {
    const FloatVec org_x = load(stream.sheared_org[0] + first);
    const FloatVec org_y = load(stream.sheared_org[1] + first);
    const FloatVec org_z = load(stream.sheared_org[2] + first);
    const FloatVec slope_x = load(stream.slope[0] + first);
    const FloatVec slope_y = load(stream.slope[1] + first);
    FloatVec m = zero(), depth = m;
    for (std::uint32_t i = 0; i < count; ++i) {
        const lanes::Float3 v = rotated(&leaf.vertex[i].x);
        const FloatVec z = v.z - org_z;
        points.x[i] = neg_mul_add(slope_x, z, v.x - org_x);
        points.y[i] = neg_mul_add(slope_y, z, v.y - org_y);
        points.z[i] = z;
        m = max(m, abs(points.x[i]) + abs(points.y[i]));
        depth = max(depth, abs(z));
    }
    points.bound = lanes::edge_bound(3.0f * m, depth);
    points.depth = depth;
}

HWY_INLINE void project_shared(const RayStream& stream, std::size_t first, const Leaf& leaf,
                               std::uint32_t count, SharedPoints& points) {
    const UintVec axis = load(stream.axis + first);
    const std::uint32_t first_axis = stream.axis[first];
    if (all(float_mask(axis == first_axis))) {
        const std::uint32_t x = (first_axis + 1) % 3, y = (first_axis + 2) % 3, z = first_axis;
        const auto rotated = [=](const float* v)
                                 HWY_ATTR { return lanes::Float3(vec3(v[x], v[y], v[z])); };
        project_rotated_shared(stream, first, leaf, count, rotated, points);
    } else {
        const auto rotated = [&axis](const float* v) HWY_ATTR {
            return lanes::rotate_axes(lanes::Float3(vec3(v[0], v[1], v[2])), axis);
        };
        project_rotated_shared(stream, first, leaf, count, rotated, points);
    }
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

/// The rays among `rays` (bits) that hit a triangle of the leaf.
HWY_INLINE std::uint64_t rays_hitting(const RayStream& stream, std::uint64_t rays,
                                      const Leaf& leaf) {
    const std::uint32_t count = corner_triangle_count(leaf.vertex[0].corners);
    const std::uint32_t vertex_count = used_vertices(leaf, count);
    std::uint64_t hits = 0;
    for (std::size_t first = 0; first < kStreamRays; first += kLanes) {
        auto left = static_cast<std::uint32_t>(rays >> first & kLaneBits);
        if (left == 0) continue;
        SharedPoints p;
        project_shared(stream, first, leaf, vertex_count, p);
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
                const lanes::Edges e{u, v, w, p.bound, range_of_z, p.depth};
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
