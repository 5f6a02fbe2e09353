// One ray against the triangles of a leaf, by the hit rule and with its bits.
//
// 1. The fast path projects the vertices and computes the edge functions of all triangles.
// 2. Most triangles are skipped by a bound of these functions that asks for no depth
//    (depthless_bound), because the largest |z| of a leaf takes longer to find than the functions.
// 3. A triangle is skipped if may_be_inside is false by its own bound, or if its hit would lie
//    behind the ray's origin for certain. The second holds for the triangle that a secondary ray
//    starts from, the most frequent one of all.
// 4. The fast path answers for those of the others that it is certain of, the exact path for the
//    rest.
#if defined(MORPHRAY_CPU_SINGLE_RAY_LEAF_HIT_RULE_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef MORPHRAY_CPU_SINGLE_RAY_LEAF_HIT_RULE_INL_H
#undef MORPHRAY_CPU_SINGLE_RAY_LEAF_HIT_RULE_INL_H
#else
#define MORPHRAY_CPU_SINGLE_RAY_LEAF_HIT_RULE_INL_H
#endif

#include <bit>
#include <cstddef>
#include <cstdint>

#include "common/interop/packet_bounds.h"
#include "common/interop/tie_break_rule.h"
#include "common/scene_queries.h"
#include "cpu/simd/lanes-inl.h"
#include "cpu/single_ray/leaf_lanes-inl.h"
#include "cpu/single_ray/ray_stream-inl.h"

HWY_BEFORE_NAMESPACE();
namespace mray::cpu {
namespace HWY_NAMESPACE {
using namespace simd::HWY_NAMESPACE;

#if HWY_TARGET == HWY_SCALAR

/// Calls visit(slot, hit) for the triangles that the ray hits no later than tfar, until it returns
/// true; whether it did. kAxis is the ray's main axis, or kAnyAxis.
template <int kAxis = kAnyAxis, class Visit>
HWY_INLINE bool intersect_leaf(const RayStream& stream, std::size_t ray, float tfar,
                               const Leaf& leaf, Visit visit) {
    ShearedRay s;
    for (int k = 0; k < 3; ++k) {
        s.org[k] = stream.sheared_org[k][ray];
        s.dir[k] = stream.sheared_dir[k][ray];
    }
    s.axis = stream.axis[ray];
    s.depth_slack = stream.depth_slack[ray];
    const std::uint32_t count = corner_triangle_count(leaf.vertex[0].corners);
    for (std::uint32_t slot = 0; slot < count; ++slot) {
        const vec3 a = leaf_position(leaf, slot, 0);
        const vec3 b = leaf_position(leaf, slot, 1);
        const vec3 c = leaf_position(leaf, slot, 2);
        TriangleHit hit;
        if (!may_hit_triangle(s, a, b, c)) continue;
        const bool is_hit = stream.crossing == Crossing::kOwner
                                ? cross_triangle(s, stream.tnear[ray], tfar, a, b, c, hit)
                                : intersect_triangle(s, stream.tnear[ray], tfar, a, b, c, hit);
        if (is_hit && visit(slot, hit)) return true;
    }
    return false;
}

/// Whether the ray hits any triangle.
template <int kAxis = kAnyAxis>
HWY_INLINE bool occluded_by_leaf(const RayStream& stream, std::size_t ray, const Leaf& leaf) {
    return intersect_leaf(stream, ray, stream.tfar[ray], leaf,
                          [](std::uint32_t, const TriangleHit&) { return true; });
}

#else

/// The projected vertices of a leaf.
struct LeafPoints {
    VertexValues x;
    VertexValues y;
    VertexValues z;

    HWY_INLINE void set(std::size_t v, const lanes::Float3& p) {
        x.set(v, p.x);
        y.set(v, p.y);
        z.set(v, p.z);
    }
    HWY_INLINE lanes::Float3 look_up(const LaneLookup& places) const {
        return {x.look_up(places), y.look_up(places), z.look_up(places)};
    }
};

/// Projects the vertices on the fast path.
HWY_INLINE void project_leaf_fast(const lanes::ShearedRay& ray, const LeafLanes& leaf,
                                  LeafPoints& points) {
    for (std::size_t v = 0; v < kVectors; ++v)
        points.set(v, lanes::project_rotated_fast(ray, {leaf.x[v], leaf.y[v], leaf.z[v]}));
}

/// A vector of triangles as the ray sees them.
struct FilteredTriangles {
    lanes::Edges edges;
    FloatVec size;
    FloatVec za;
    FloatVec zb;
    FloatVec zc;
};

/// The edge functions of fast_edges(), and their bound for vertices at any depth.
HWY_INLINE FilteredTriangles flat_triangles(const LeafPoints& points, const VertexLookups& at,
                                            const DepthlessBound<FloatVec>& bound) {
    const lanes::Float3 a{points.x.look_up(at.a), points.y.look_up(at.a), zero()};
    const lanes::Float3 b{points.x.look_up(at.b), points.y.look_up(at.b), zero()};
    const lanes::Float3 c{points.x.look_up(at.c), points.y.look_up(at.c), zero()};
    FilteredTriangles t;
    t.size = sum3(lanes::projected_size(a), lanes::projected_size(b), lanes::projected_size(c));
    t.edges.bound = bound(t.size);
    t.edges.u = lanes::fast_edge(b, c);
    t.edges.v = lanes::fast_edge(c, a);
    t.edges.w = lanes::fast_edge(a, b);
    return t;
}

/// Completes fast_edges().
HWY_INLINE void add_depth(const LeafPoints& points, const VertexLookups& at, FilteredTriangles& t) {
    t.za = points.z.look_up(at.a);
    t.zb = points.z.look_up(at.b);
    t.zc = points.z.look_up(at.c);
    lanes::measure_depth(t.za, t.zb, t.zc, t.edges);
    t.edges.bound = lanes::edge_bound(t.size, t.edges.depth_size);
}

/// The lanes of vector v that hold triangles.
HWY_INLINE Mask used_lanes(UintVec local_vertices, std::size_t v) {
    return float_mask(slots_of_vector(v) < shift_right<24>(local_vertices));
}

HWY_INLINE Mask finite_lanes(const LeafLanes& vertices, const VertexLookups& at) {
    VertexValues x;
    for (std::size_t v = 0; v < kVectors; ++v) x.set(v, vertices.x[v]);
    return lanes::finite_coordinates(x.look_up(at.a), x.look_up(at.b), x.look_up(at.c));
}

/// Calls visit(slot, hit) for these lanes of vector v until it returns true; whether it did.
template <class Visit>
HWY_INLINE bool visit_lanes(std::size_t v, Mask visited, const lanes::TriangleHit& hits,
                            Visit& visit) {
    HWY_ALIGN float t[kLanes];
    HWY_ALIGN float u[kLanes];
    HWY_ALIGN float w[kLanes];
    store(hits.t, t);
    store(hits.u, u);
    store(hits.v, w);
    for (std::uint32_t bits = bits_of(visited); bits != 0; bits &= bits - 1) {
        const auto i = static_cast<std::uint32_t>(std::countr_zero(bits));
        const auto first = static_cast<std::uint32_t>(v * kLanes);
        if (visit(slot_of_lane(first + i), TriangleHit{t[i], u[i], w[i]})) return true;
    }
    return false;
}

/// The exact path for the triangles that are uncertain, as bits.
template <class Visit>
HWY_NOINLINE bool intersect_leaf_exactly(const RayStream& stream, std::size_t ray, float tfar,
                                         const Leaf& leaf, std::uint32_t uncertain, Visit visit) {
    const LeafLanes vertices = load_leaf<kAnyAxis>(leaf, stream.axis[ray]);
    const lanes::ShearedRay s = sheared_ray(stream, ray);
    LeafPoints points;
    for (std::size_t v = 0; v < kVectors; ++v) {
        points.set(v, lanes::project_rotated(s, {vertices.x[v], vertices.y[v], vertices.z[v]}));
    }
    for (std::size_t v = 0; v < kVectors; ++v) {
        const std::uint32_t bits = uncertain >> (v * kLanes) & kLaneBits;
        if (bits == 0) continue;
        const VertexLookups at(vertices.local_vertices[v]);
        const lanes::Float3 a = points.look_up(at.a);
        const lanes::Float3 b = points.look_up(at.b);
        const lanes::Float3 c = points.look_up(at.c);
        lanes::TriangleHit hit;
        const lanes::Edges edges = lanes::exact_edges(a, b, c);
        Mask hits = lanes::exact_hit(s, edges, a.z, b.z, c.z, hit);
        if (stream.crossing == Crossing::kOwner) hits = hits & lanes::owns_ray(edges, a, b, c);
        hits = hits & lanes::is_in_range(hit.t, splat(stream.tnear[ray]), splat(tfar));
        hits = hits & mask_of(bits);
        if (none(hits)) continue;
        if (visit_lanes(v, hits & finite_lanes(vertices, at), hit, visit)) return true;
    }
    return false;
}

/// True for triangles whose corners are at one place: their edge functions are all 0.
HWY_INLINE Mask all_edges_are_equal(const lanes::Edges& e) {
    return min3(e.u, e.v, e.w) == max3(e.u, e.v, e.w);
}

/// Calls test(v, at, triangles, mean, possible) for the vectors v of triangles some of which the
/// ray may hit, until it returns true; whether it did.
template <class Test>
HWY_INLINE bool any_possible_vector(const RayStream& stream, std::size_t ray,
                                    const lanes::ShearedRay& s, const LeafLanes& vertices,
                                    Test test) {
    LeafPoints points;
    project_leaf_fast(s, vertices, points);
    const DepthlessBound<FloatVec> bound{splat(stream.bound_linear[ray]),
                                         splat(stream.bound_constant[ray])};
    for (std::size_t v = 0; v < kVectors; ++v) {
        const VertexLookups at(vertices.local_vertices[v]);
        FilteredTriangles t = flat_triangles(points, at, bound);
        Mask inside = lanes::may_be_inside(t.edges) & used_lanes(vertices.local_vertices[v], v);
        if (none(inside)) continue;
        if (!none(inside & all_edges_are_equal(t.edges))) {
            inside = and_not(equal_corners(vertices, at), inside);
            if (none(inside)) continue;
        }
        add_depth(points, at, t);
        const DepthSum mean = depth_sum(t.edges, t.za, t.zb, t.zc, s.dir.z);
        const Mask possible = lanes::may_be_inside(t.edges) & may_be_ahead(t.edges, mean) & inside;
        if (!none(possible) && test(v, at, t, mean, possible)) return true;
    }
    return false;
}

/// Calls visit(slot, hit) for the triangles that the ray hits no later than tfar, until it returns
/// true; whether it did. kAxis is the ray's main axis, or kAnyAxis.
template <int kAxis = kAnyAxis, class Visit>
HWY_INLINE bool intersect_leaf(const RayStream& stream, std::size_t ray, float tfar,
                               const Leaf& leaf, Visit visit) {
    const LeafLanes vertices = load_leaf<kAxis>(leaf, stream.axis[ray]);
    const lanes::ShearedRay s = sheared_ray(stream, ray);
    std::uint32_t uncertain = 0;
    const auto visit_hits = [&](std::size_t v, const VertexLookups& at, const FilteredTriangles& t,
                                const DepthSum&, Mask possible) HWY_ATTR {
        lanes::TriangleHit hit;
        const Mask is_certain = lanes::weighted_hit(s, t.edges, t.za, t.zb, t.zc, hit);
        const Mask is_hit = is_certain & lanes::surely_inside(s, t.edges);
        const Mask reached = lanes::is_in_range(hit.t, splat(stream.tnear[ray]), splat(tfar));
        const Mask hits = possible & is_hit & reached;
        uncertain |= bits_of(and_not(is_hit, possible)) << (v * kLanes);
        return !none(hits) && visit_lanes(v, hits & finite_lanes(vertices, at), hit, visit);
    };
    if (any_possible_vector(stream, ray, s, vertices, visit_hits)) return true;
    return uncertain != 0 && intersect_leaf_exactly(stream, ray, tfar, leaf, uncertain, visit);
}

/// Whether the ray hits any triangle.
template <int kAxis = kAnyAxis>
HWY_INLINE bool occluded_by_leaf(const RayStream& stream, std::size_t ray, const Leaf& leaf) {
    const LeafLanes vertices = load_leaf<kAxis>(leaf, stream.axis[ray]);
    const CertainRange range = certain_range(stream, ray);
    bool is_uncertain = false;
    const auto is_occluder = [&](std::size_t, const VertexLookups& at, const FilteredTriangles& t,
                                 const DepthSum& mean, Mask possible) HWY_ATTR {
        const Mask certain = certain_occluders(t.edges, mean, range) & possible;
        if (!none(certain) && !none(certain & finite_lanes(vertices, at))) return true;
        is_uncertain |= !none(and_not(certainly_beyond(t.edges, mean, range), possible));
        return false;
    };
    if (any_possible_vector(stream, ray, sheared_ray(stream, ray), vertices, is_occluder))
        return true;
    return is_uncertain && intersect_leaf(stream, ray, stream.tfar[ray], leaf,
                                          [](std::uint32_t, const TriangleHit&) { return true; });
}

#endif  // HWY_TARGET

}  // namespace HWY_NAMESPACE
}  // namespace mray::cpu
HWY_AFTER_NAMESPACE();

#endif  // per target
