// The triangles of a leaf by the hit rule and with its bits: a leaf in vectors; tests by plain edge
// functions, certain without the rule; one ray, with triangles for lanes; and closest and any hits
// of many rays, with rays for lanes.
#if defined(MORPHRAY_CPU_SINGLE_RAY_LEAF_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef MORPHRAY_CPU_SINGLE_RAY_LEAF_INL_H
#undef MORPHRAY_CPU_SINGLE_RAY_LEAF_INL_H
#else
#define MORPHRAY_CPU_SINGLE_RAY_LEAF_INL_H
#endif

#include <algorithm>
#include <array>
#include <bit>

#include "cpu/simd/hit_rule-inl.h"
#include "cpu/single_ray/ray_stream-inl.h"

HWY_BEFORE_NAMESPACE();
namespace mray::cpu::HWY_NAMESPACE {

// ---- Vectors of a leaf

/// Whether two corners of a triangle are at one place, bit for bit: no ray hits it
/// (docs/design/arithmetic.md, "No area"), but all edge functions may be 0, which only the exact
/// path can tell from a hit.
HWY_INLINE bool has_equal_corners(const Leaf& leaf, std::uint32_t triangle) {
    const auto are_equal = [&](uint i, uint j) {
        const vec3 p = leaf_position(leaf, triangle, i), q = leaf_position(leaf, triangle, j);
        return std::memcmp(&p, &q, sizeof p) == 0;
    };
    return are_equal(0, 1) || are_equal(1, 2) || are_equal(2, 0);
}

// A vector load of a leaf brings kBlocks whole vertices, one to a block of 4 lanes. Four loads are
// transposed within the blocks, which is cheap on every target, so slots are not in order
// (slot_of_lane). Triangles have the same order, since their indices are stored with the vertices.
// Vectors of one lane take a vertex each.
inline constexpr std::uint32_t kBlocks = kLanes / 4;

/// The slot of lane i of vector v, for lane = v * kLanes + i.
constexpr std::uint32_t slot_of_lane(std::uint32_t lane) {
    const std::uint32_t i = lane % kLanes;
    return lane - i + kBlocks * (i % 4) + i / 4;
}

alignas(16) inline constexpr auto kLaneOfSlot = [] {
    std::array<std::uint8_t, kMaxLanes> lanes{};
    for (std::uint8_t lane = 0; lane < lanes.size(); ++lane) lanes[slot_of_lane(lane)] = lane;
    return lanes;
}();

HWY_INLINE UintVec slots_of_vector(std::size_t v) {
    const UintVec lane = hn::Iota(kUints, 0u);
    const UintVec in_block = lane & splat(3u);
    const UintVec block = shift_right<2>(lane);
    return in_block * splat(kBlocks) + block + splat(static_cast<std::uint32_t>(v * kLanes));
}

/// For each axis, the bytes of a vertex (x, y, z, local vertex indices) in the order of
/// rotate_axes.
alignas(16) inline constexpr std::uint8_t kRotations[3][16] = {
    {4, 5, 6, 7, 8, 9, 10, 11, 0, 1, 2, 3, 12, 13, 14, 15},
    {8, 9, 10, 11, 0, 1, 2, 3, 4, 5, 6, 7, 12, 13, 14, 15},
    {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15},
};

/// The vertices of a leaf with rotated axes, and the local vertex indices of its triangles.
struct LeafLanes {
    FloatVec x[kVectors], y[kVectors], z[kVectors];
    UintVec local_vertices[kVectors];
    std::uint32_t triangle_count;
};

/// Loads a leaf for rays with this main axis; kAxis is the same, or kAnyAxis.
template <int kAxis>
HWY_INLINE LeafLanes load_leaf(const Leaf& leaf, std::uint32_t axis) {
    LeafLanes out;
    out.triangle_count = corner_triangle_count(leaf.vertex[0].corners);
    for (std::size_t v = 0; v < kVectors; ++v) {
        FloatVec column[4];
#if HWY_TARGET == HWY_SCALAR
        for (std::uint32_t i = 0; i < 4; ++i) {
            const bool is_rotated = kAxis == kAnyAxis && i < 3;
            column[i] = load(&leaf.vertex[v].x + (is_rotated ? (axis + 1 + i) % 3 : i));
        }
#else
        const auto rotation = hn::LoadDup128(kBytes, kRotations[axis]);
        FloatVec row[4];
        for (std::size_t i = 0; i < 4; ++i) {
            const float* vertices = &leaf.vertex[v * kLanes + i * kBlocks].x;
            const auto bytes = hn::BitCast(kBytes, load_unaligned(vertices));
            row[i] = as_float(kAxis == kAnyAxis ? hn::TableLookupBytes(bytes, rotation) : bytes);
        }
        transpose_fours(kFloats, row, column);
#endif
        out.x[v] = column[kAxis == kAnyAxis ? 0 : (kAxis + 1) % 3];
        out.y[v] = column[kAxis == kAnyAxis ? 1 : (kAxis + 2) % 3];
        out.z[v] = column[kAxis == kAnyAxis ? 2 : kAxis];
        out.local_vertices[v] = as_uint(column[3]);
    }
    return out;
}

/// A value for each vertex slot: in vectors, or in memory where permuting vectors does not pay.
class VertexValues {
public:
    VertexValues() = default;
    HWY_INLINE explicit VertexValues(const FloatVec* values) {
        for (std::size_t v = 0; v < kVectors; ++v) set(v, values[v]);
    }

    HWY_INLINE void set(std::size_t v, FloatVec values) {
        if constexpr (kVectors <= 2) {
            vectors_[v] = values;
        } else {
            store(values, table_ + v * kLanes);
        }
    }
    HWY_INLINE FloatVec look_up(const LaneLookup& places) const { return places(vectors_, table_); }

private:
    FloatVec vectors_[kVectors];
    HWY_ALIGN PerVertex<float> table_;
};

struct VertexLookups {
    LaneLookup a, b, c;

    HWY_INLINE explicit VertexLookups(UintVec local_vertices)
        : VertexLookups(places_of(local_vertices), 0) {}

private:
    HWY_INLINE VertexLookups(UintVec places, int)
        : a(places & splat(15u)),
          b(shift_right<8>(places) & splat(15u)),
          c(shift_right<16>(places) & splat(15u)) {}

    /// The places in VertexValues of the slots in the bytes.
    HWY_INLINE static UintVec places_of(UintVec slots) {
#if HWY_TARGET != HWY_SCALAR
        if constexpr (kVectors <= 2) {
            const auto places = hn::LoadDup128(kBytes, kLaneOfSlot.data());
            return hn::BitCast(kUints, hn::TableLookupBytes(places, hn::BitCast(kBytes, slots)));
        }
#endif
        return slots;
    }
};

HWY_INLINE Mask equal_corners(const LeafLanes& vertices, const VertexLookups& at) {
    const auto equal = [](FloatVec p, FloatVec q)
                           HWY_ATTR { return float_mask(as_uint(p) == as_uint(q)); };
    Mask ab = equal(zero(), zero()), bc = ab, ca = ab;
    for (const FloatVec* values : {vertices.x, vertices.y, vertices.z}) {
        const VertexValues corners(values);
        const FloatVec a = corners.look_up(at.a);
        const FloatVec b = corners.look_up(at.b);
        const FloatVec c = corners.look_up(at.c);
        ab = ab & equal(a, b);
        bc = bc & equal(b, c);
        ca = ca & equal(c, a);
    }
    return ab | bc | ca;
}

// ---- Certain answers, derived in docs/design/arithmetic.md, "Rays without packets"

/// The sum of |e| z over plain edge functions e, by the sign of dir.z, and that of |e|.
struct DepthSum {
    FloatVec n, s;
};

/// Fused or not: this decides no hit without a bound.
HWY_INLINE DepthSum depth_sum(const lanes::Edges& e, FloatVec za, FloatVec zb, FloatVec zc,
                              FloatVec dz) {
    const FloatVec au = abs(e.u), av = abs(e.v), aw = abs(e.w);
    const FloatVec n = mul_add(aw, zc, mul_add(av, zb, au * za));
    return {n ^ (dz & splat(-0.0f)), sum3(au, av, aw)};
}

/// The range of z in which a hit is certain, by the sign of dir.z, and where hits beyond tfar
/// begin.
struct CertainRange {
    FloatVec from, to, beyond;
};

template <class Rays>
HWY_INLINE CertainRange certain_range(const auto& stream, Rays of) {
    return {of(stream.certain_from), of(stream.certain_to), of(stream.certain_beyond)};
}

/// The lanes whose triangle the ray goes through for certain.
HWY_INLINE Mask surely_through(const lanes::Edges& e) {
    return (min3(e.u, e.v, e.w) > e.bound) | (max3(e.u, e.v, e.w) < -e.bound);
}

/// The lanes in which the rule certainly finds a hit between tnear and tfar, if the vertices are
/// finite. Of e it takes u, v, w, bound and depth_size, which may hold for a whole leaf.
HWY_INLINE Mask certain_occluders(const lanes::Edges& e, const DepthSum& depth,
                                  const CertainRange& range) {
    const FloatVec slack = kCertainBound * e.bound * e.depth_size;
    return surely_through(e) & (neg_mul_add(range.from, depth.s, depth.n) >= slack) &
           (mul_sub(range.to, depth.s, depth.n) >= slack);
}

/// The lanes whose triangle is hit beyond tfar, if at all. Of e it takes bound, as above, and
/// depth_range. by_bound: kBeyondBound, or own_beyond_bound().
HWY_INLINE Mask certainly_beyond(const lanes::Edges& e, const DepthSum& depth,
                                 const CertainRange& range, FloatVec by_bound) {
    const FloatVec slack = by_bound * e.bound * e.depth_range;
    return (neg_mul_add(range.beyond, depth.s, depth.n) >= slack) &
           (depth.s >= kCertainBound * e.bound);
}

/// For edge functions and bounds that are the rule's own.
HWY_INLINE FloatVec own_beyond_bound(const lanes::Edges& e) {
    return select(surely_through(e), splat(kOwnBeyondBound), splat(kBeyondBound));
}

// More than what underflow takes from the products: 2^-120.
inline constexpr float kBehindUnderflow = 0x1p-120f;

/// False in lanes whose triangle would be hit behind the origin only. Of e it takes bound and
/// depth_size, as above.
HWY_INLINE Mask may_be_ahead(const lanes::Edges& e, const DepthSum& depth) {
    const FloatVec error = mul_add(splat(kBehindError), depth.s, 4.0f * e.bound);
    const FloatVec slack = mul_add(e.depth_size, error, splat(kBehindUnderflow));
    return depth.n >= -slack;
}

// ---- One ray
//
// Most triangles are skipped by a bound of their edge functions that needs no depth, because the
// largest |z| of a leaf takes longer to find; others by their own bound, or behind the origin.

struct LeafPoints {
    VertexValues x, y, z;

    template <class Project>
    HWY_INLINE LeafPoints(const LeafLanes& vertices, Project project) {
        for (std::size_t v = 0; v < kVectors; ++v) {
            const lanes::Float3 p =
                project(lanes::Float3(vertices.x[v], vertices.y[v], vertices.z[v]));
            x.set(v, p.x);
            y.set(v, p.y);
            z.set(v, p.z);
        }
    }
    HWY_INLINE TriangleCorners look_up(const VertexLookups& at) const {
        return {point(at.a), point(at.b), point(at.c)};
    }

private:
    HWY_INLINE lanes::Float3 point(const LaneLookup& places) const {
        return {x.look_up(places), y.look_up(places), z.look_up(places)};
    }
};

inline constexpr auto kInPlace = [](const lanes::Float3& p) { return p; };

struct FilteredTriangles {
    lanes::Edges edges;
    FloatVec size, za, zb, zc;
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

HWY_INLINE Mask used_lanes(UintVec local_vertices, std::size_t v) {
    return float_mask(slots_of_vector(v) < shift_right<24>(local_vertices));
}

HWY_INLINE Mask finite_lanes(const LeafLanes& vertices, const VertexLookups& at) {
    const VertexValues x(vertices.x);
    return lanes::finite_coordinates(x.look_up(at.a), x.look_up(at.b), x.look_up(at.c));
}

HWY_INLINE TriangleCorners triangles_of_vector(const Leaf& leaf, std::size_t v) {
    const LeafLanes vertices = load_leaf<2>(leaf, 2);
    return LeafPoints(vertices, kInPlace).look_up(VertexLookups(vertices.local_vertices[v]));
}

/// The lanes of vector v among `hits` that are hits no later than tfar once they are refined.
HWY_NOINLINE inline Mask refined_in_slots(const auto& stream, std::size_t ray, float tfar,
                                          const Leaf& leaf, std::size_t v, const lanes::Edges& e,
                                          Mask hits, lanes::TriangleHit& hit) {
    return refined_in_range(sheared(stream, OneRay{ray}), e,
                            {splat(stream.tnear[ray]), splat(tfar)}, triangles_of_vector(leaf, v),
                            hits, hit);
}

/// Calls visit(slot, hit) for these lanes of vector v until it returns true; whether it did.
template <class Visit>
HWY_INLINE bool visit_lanes(std::size_t v, Mask visited, const lanes::TriangleHit& hits,
                            Visit& visit) {
    HWY_ALIGN float t[kLanes], u[kLanes], w[kLanes];
    store(hits.t, t);
    store(hits.u, u);
    store(hits.v, w);
    const auto first = static_cast<std::uint32_t>(v * kLanes);
    for (const std::uint32_t i : BitsOf(bits_of(visited)))
        if (visit(slot_of_lane(first + i), TriangleHit{t[i], u[i], w[i], 0, 0})) return true;
    return false;
}

/// The exact path for the triangles that are uncertain, as bits.
template <class Visit>
HWY_NOINLINE bool intersect_leaf_exactly(const auto& stream, std::size_t ray, float tfar,
                                         const Leaf& leaf, std::uint32_t uncertain, Visit visit) {
    const lanes::ShearedRay s = sheared(stream, OneRay{ray});
    const HitRange range = {splat(stream.tnear[ray]), splat(tfar), stream.crossing};
    for (std::size_t v = 0; v < kVectors; ++v) {
        const std::uint32_t bits = uncertain >> (v * kLanes) & kLaneBits;
        if (bits == 0) continue;
        const TriangleCorners t = triangles_of_vector(leaf, v);
        lanes::TriangleHit hit;
        const Mask hits = intersect_exactly(s, range, t, mask_of(bits), hit);
        if (visit_lanes(v, hits & lanes::finite_vertices(t.a, t.b, t.c), hit, visit)) return true;
    }
    return false;
}

/// Calls test(v, at, triangles, mean, possible) for the vectors v of triangles some of which the
/// ray may hit, until it returns true; whether it did.
template <class Test>
HWY_INLINE bool any_possible_vector(const auto& stream, std::size_t ray, const lanes::ShearedRay& s,
                                    const LeafLanes& vertices, Test test) {
    const LeafPoints points(vertices, [&](const lanes::Float3& v)
                                          HWY_ATTR { return lanes::project_rotated_fast(s, v); });
    const DepthlessBound<FloatVec> bound{splat(stream.bound_linear[ray]),
                                         splat(stream.bound_constant[ray])};
    for (std::size_t v = 0; v < kVectors; ++v) {
        // The first vector has triangles in every leaf.
        if (v != 0 && v * kLanes >= vertices.triangle_count) break;
        const VertexLookups at(vertices.local_vertices[v]);
        FilteredTriangles t = flat_triangles(points, at, bound);
        Mask inside = lanes::may_be_inside(t.edges) & used_lanes(vertices.local_vertices[v], v);
        if (none(inside)) continue;
        // Triangles whose corners are at one place have edge functions that are all 0.
        const lanes::Edges& e = t.edges;
        if (!none(inside & (min3(e.u, e.v, e.w) == max3(e.u, e.v, e.w)))) {
            inside = and_not(equal_corners(vertices, at), inside);
            if (none(inside)) continue;
        }
        t.za = points.z.look_up(at.a);
        t.zb = points.z.look_up(at.b);
        t.zc = points.z.look_up(at.c);
        lanes::measure_depth(t.za, t.zb, t.zc, t.edges);
        t.edges.bound = lanes::edge_bound(t.size, t.edges.depth_size);
        t.edges.real_bound = t.edges.bound;
        const DepthSum mean = depth_sum(t.edges, t.za, t.zb, t.zc, s.dir.z);
        const Mask possible = lanes::may_be_inside(t.edges) & may_be_ahead(t.edges, mean) & inside;
        if (!none(possible) && test(v, at, t, mean, possible)) return true;
    }
    return false;
}

struct FilteredHits {
    Mask certain, rough, uncertain;
};

/// The triangles among `possible` that the fast path finds hit no later than tfar, those whose hit
/// is rough, and those that it leaves to the exact path.
HWY_INLINE FilteredHits filtered_hits(const auto& stream, std::size_t ray, float tfar,
                                      const lanes::ShearedRay& s, const FilteredTriangles& t,
                                      Mask possible, lanes::TriangleHit& hit) {
    const Mask is_certain = lanes::weighted_hit(s, t.edges, t.za, t.zb, t.zc, hit);
    const Mask is_hit = is_certain & lanes::surely_inside(s, t.edges);
    const Mask is_rough = lanes::is_rough(hit);
    const FloatVec tnear = splat(stream.tnear[ray]);
    const Mask reached = and_not(is_rough, lanes::is_in_range(hit.t, tnear, splat(tfar)));
    return {possible & is_hit & reached,
            possible & is_hit & is_rough & lanes::may_be_in_range(hit, tnear, splat(tfar)),
            and_not(is_hit, possible)};
}

/// filtered_hits() up to the ray's tfar, with rough hits refined. Few leaves need it; inlined, it
/// would spill registers in the loop over leaves.
HWY_NOINLINE inline FilteredHits filtered_occluders(const auto& stream, std::size_t ray,
                                                    const Leaf& leaf, std::size_t v,
                                                    const FilteredTriangles& t, Mask possible) {
    lanes::TriangleHit hit;
    const float tfar = stream.tfar[ray];
    FilteredHits hits =
        filtered_hits(stream, ray, tfar, sheared(stream, OneRay{ray}), t, possible, hit);
    // Certain hits may be of vertices that are not finite.
    if (!none(hits.rough)) {
        hits.certain =
            hits.certain | refined_in_slots(stream, ray, tfar, leaf, v, t.edges, hits.rough, hit);
    }
    return hits;
}

/// Calls visit(slot, hit) for the triangles that the ray hits no later than tfar, until it returns
/// true; whether it did. kAxis is the ray's main axis, or kAnyAxis.
template <int kAxis = kAnyAxis, class Visit>
HWY_INLINE bool intersect_leaf(const auto& stream, std::size_t ray, float tfar, const Leaf& leaf,
                               Visit visit) {
    const LeafLanes vertices = load_leaf<kAxis>(leaf, stream.axis[ray]);
    const lanes::ShearedRay s = sheared(stream, OneRay{ray});
    std::uint32_t uncertain = 0;
    const auto visit_hits = [&](std::size_t v, const VertexLookups& at, const FilteredTriangles& t,
                                const DepthSum&, Mask possible) HWY_ATTR {
        lanes::TriangleHit hit;
        const FilteredHits hits = filtered_hits(stream, ray, tfar, s, t, possible, hit);
        uncertain |= bits_of(hits.uncertain) << (v * kLanes);
        if (HWY_UNLIKELY(!none(hits.rough))) {
            // Copies, so that the others need not be in memory.
            lanes::TriangleHit refined = hit;
            const lanes::Edges edges = t.edges;
            const Mask found =
                refined_in_slots(stream, ray, tfar, leaf, v, edges, hits.rough, refined);
            if (visit_lanes(v, found, refined, visit)) return true;
        }
        return !none(hits.certain) &&
               visit_lanes(v, hits.certain & finite_lanes(vertices, at), hit, visit);
    };
    if (any_possible_vector(stream, ray, s, vertices, visit_hits)) return true;
    return uncertain != 0 && intersect_leaf_exactly(stream, ray, tfar, leaf, uncertain, visit);
}

template <int kAxis = kAnyAxis>
HWY_INLINE bool occluded_by_leaf(const auto& stream, std::size_t ray, const Leaf& leaf) {
    const LeafLanes vertices = load_leaf<kAxis>(leaf, stream.axis[ray]);
    const CertainRange range = certain_range(stream, OneRay{ray});
    std::uint32_t uncertain = 0;
    const auto is_occluder = [&](std::size_t v, const VertexLookups& at, const FilteredTriangles& t,
                                 const DepthSum& mean, Mask possible) HWY_ATTR {
        const Mask certain = certain_occluders(t.edges, mean, range) & possible;
        if (!none(certain) && !none(certain & finite_lanes(vertices, at))) return true;
        possible =
            and_not(certainly_beyond(t.edges, mean, range, own_beyond_bound(t.edges)), possible);
        if (none(possible)) return false;
        // A copy, so that `t` itself need not be in memory.
        const FilteredTriangles copy = t;
        const FilteredHits hits = filtered_occluders(stream, ray, leaf, v, copy, possible);
        uncertain |= bits_of(hits.uncertain) << (v * kLanes);
        return !none(hits.certain) && !none(hits.certain & finite_lanes(vertices, at));
    };
    if (any_possible_vector(stream, ray, sheared(stream, OneRay{ray}), vertices, is_occluder))
        return true;
    return uncertain != 0 &&
           intersect_leaf_exactly(stream, ray, stream.tfar[ray], leaf, uncertain,
                                  [](std::uint32_t, const TriangleHit&) { return true; });
}

// ---- Closest hits of many rays
//
// The leaf's vertices are projected once for a vector of rays, by the rule's fast path, and one
// bound for the leaf skips most triangles (docs/design/arithmetic.md, "Rays without packets").

/// The vertices of a leaf as rays see them, and a bound of the edge functions of all its triangles.
struct ProjectedLeaf {
    PerVertex<FloatVec> x, y, z;
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
    float t[kStreamRays], last[kStreamRays], u[kStreamRays], v[kStreamRays];
    std::uint32_t prim_id[kStreamRays];

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

    /// Keeps the hits of triangle `id` that are closer, by is_closer; lanes are the rays from
    /// `first` on.
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
HWY_INLINE void intersect_leaf_alone(const auto& stream, std::size_t ray, const Leaf& leaf,
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

/// Rays that are asked about a leaf, one a lane. Together in a structure they take less time.
struct LeafRays {
    std::size_t first;
    lanes::ShearedRay sheared;
    Mask asked;
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
    e.real_bound = e.bound;
    const DepthSum depth = depth_sum(e, a.z, b.z, c.z, s.dir.z);
    const Mask possible = rays.asked & lanes::may_be_inside(e) & may_be_ahead(e, depth);
    if (none(possible)) return;
    const FloatVec tfar = load(tfar_of_rays + rays.first);
    lanes::TriangleHit hit;
    const Mask hits =
        decide_hits(s, {e, a.z, b.z, c.z}, possible, {rays.tnear, tfar, rays.crossing},
                    corners_in_lanes(leaf, i), hit);
    keep(hits, hit, leaf.prim_id[i]);
}

/// Calls keep(hits, hit, prim_id) for the triangles of a leaf that rays among `active` (bits, from
/// `first` on) hit no later than tfar of their rays: lanes are rays.
template <class Keep>
HWY_INLINE void intersect_leaf_together(const RayStream& stream, std::size_t first,
                                        std::uint32_t active, const float* tfar, const Leaf& leaf,
                                        Keep keep) {
    const std::uint32_t count = corner_triangle_count(leaf.vertex[0].corners);
    const LeafRays rays{first, sheared(stream, RaysFrom{first}), mask_of(active),
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
        if (none(lanes::may_be_inside(e) & rays.asked)) continue;
        intersect_triangle(rays, tfar, leaf, i, points, e, keep);
    }
}

/// The closest hits of the rays `active` (bits, from `first` on) in a leaf.
HWY_INLINE void intersect_leaf_together(const RayStream& stream, std::size_t first,
                                        std::uint32_t active, const Leaf& leaf,
                                        ClosestHits& closest) {
    intersect_leaf_together(stream, first, active, closest.t, leaf,
                            [&](Mask hits, const lanes::TriangleHit& hit, std::uint32_t prim_id)
                                HWY_ATTR { closest.keep_closer(first, hits, hit, prim_id); });
}

// The rays of a vector are tested together in a leaf if they are more than this many
// (lab/notes/cpu_tracer.md).
inline constexpr std::size_t kTogetherInLeaf = kLanes == 1 ? 1 : kLanes < 16 ? 3 : 6;

/// Calls together(first, active) for the vectors with many of these rays (bits), alone(ray) for the
/// rays of others.
template <class Together, class Alone>
HWY_INLINE void for_rays_of_leaf(std::uint64_t rays, Together together, Alone alone) {
    for (std::size_t first = 0; first < kStreamRays; first += kLanes) {
        const auto active = static_cast<std::uint32_t>(rays >> first & kLaneBits);
        if (static_cast<std::size_t>(std::popcount(active)) > kTogetherInLeaf) {
            together(first, active);
            continue;
        }
        for (const std::uint32_t ray : BitsOf(active)) alone(first + ray);
    }
}

// ---- Any hits of many rays
//
// For rays that have a leaf in common, such as ambient-occlusion rays around one place, this takes
// fewer instructions than one ray after the other (lab/notes/cpu_tracer.md). Vertices are projected
// by slopes (docs/design/arithmetic.md, "Rays without packets").

/// The rays among `rays` (bits, from `first` on) that hit triangle i of the leaf.
HWY_NOINLINE inline std::uint32_t rays_hitting_triangle(const RayStream& stream, std::size_t first,
                                                        std::uint32_t rays, const Leaf& leaf,
                                                        std::uint32_t i) {
    lanes::TriangleHit hit;
    return bits_of(intersect_triangles(sheared(stream, RaysFrom{first}), mask_of(rays),
                                       {load(stream.tnear + first), load(stream.tfar + first)},
                                       corners_in_lanes(leaf, i), hit));
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
        const CertainRange range = certain_range(stream, RaysFrom{first});
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
                const lanes::Edges e{u, v, w, p.bound, range_of_z, largest_z, p.bound};
                const DepthSum depth = depth_sum(e, za, zb, zc, dz);
                const std::uint32_t certain =
                    bits_of(certain_occluders(e, depth, range)) & possible;
                hits |= std::uint64_t{certain} << first;
                left &= ~certain;
                const Mask beyond = certainly_beyond(e, depth, range, splat(kBeyondBound));
                possible &= ~certain & bits_of(and_not(beyond, may_be_ahead(e, depth)));
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

}  // namespace mray::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per target
