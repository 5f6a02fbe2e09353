// Queries about all triangles of a tree: all hits of rays; windings of points; the closest triangle
// to a point, and its rivals. All arithmetic is the shared text of the rules.
#include "cpu/queries/tree_queries.h"

#include <algorithm>
#include <bit>
#include <limits>
#include <span>
#include <type_traits>
#include <vector>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "cpu/queries/tree_queries.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "cpu/single_ray/walks-inl.h"

HWY_BEFORE_NAMESPACE();
namespace mray::cpu::HWY_NAMESPACE {

// ---- Filters

/// For a ray or point for which every triangle exists.
struct SeesAll {
    bool operator()(std::uint32_t) const { return true; }
    bool hides(std::size_t) const { return false; }
};
template <class Sees>
inline constexpr bool kSeesAll = std::is_same_v<Sees, SeesAll>;

/// The triangles that exist for a ray or point of a query.
struct SeesSome {
    const TriangleFilter& filter;
    std::size_t asked;

    bool operator()(std::uint32_t prim_id) const { return filter.sees(asked, prim_id); }
    bool hides(std::size_t subtree) const { return filter.hides && filter.hides(asked, subtree); }
};

/// Calls answer(i, sees) for `count` rays or points of a query with the filter of each.
HWY_INLINE void for_each_asked(const auto& query, std::size_t count, auto answer) {
    for (std::size_t i = 0; i < count; ++i) {
        query.watch.throw_if_cancelled();
        query.filter == nullptr ? answer(i, SeesAll{}) : answer(i, SeesSome{*query.filter, i});
    }
}

HWY_INLINE bool hides_node(const Bvh& bvh, const Node& node, auto sees) {
    return sees.hides(static_cast<std::size_t>(&node - bvh.nodes.data()));
}
HWY_INLINE bool hides_leaf(const Bvh& bvh, const Leaf& leaf, auto sees) {
    return sees.hides(bvh.nodes.size() + static_cast<std::size_t>(&leaf - bvh.leaves.data()));
}

// ---- Hits

/// Calls visit(prim_id, hit) for all triangles of a leaf that a ray sees and hits no later than
/// tfar, among them the repeated ones. kAxis is the ray's main axis, or kAnyAxis.
template <int kAxis = kAnyAxis, class Visit, class Sees = SeesAll>
HWY_INLINE void for_each_hit_of_leaf(const Bvh& bvh, const auto& stream, std::size_t ray,
                                     float tfar, const Leaf& leaf, Visit visit, Sees sees = {}) {
    if (hides_leaf(bvh, leaf, sees)) return;
    intersect_leaf<kAxis>(stream, ray, tfar, leaf, [&](std::uint32_t slot, const TriangleHit& hit) {
        const std::uint32_t prim_id = leaf.prim_id[slot];
        if (sees(prim_id)) visit(prim_id, hit);
        if (bvh.repeated.empty()) [[likely]]
            return false;
        for (const RepeatedTriangle& repeat : repeats_of(bvh.repeated, prim_id))
            if (sees(repeat.prim_id)) visit(repeat.prim_id, hit);
        return false;
    });
}

template <class Visit, class Sees = SeesAll>
HWY_INLINE void for_each_hit(const Bvh& bvh, const auto& stream, std::size_t ray,
                             std::uint32_t root, Visit visit, Sees sees = {}) {
    const auto met = [&](const Node& node) HWY_ATTR {
        return hides_node(bvh, node, sees) ? 0u : met_slots(stream, ray, node);
    };
    const auto visit_leaf = [&](const Leaf& leaf) HWY_ATTR {
        for_each_hit_of_leaf(bvh, stream, ray, stream.tfar[ray], leaf, visit, sees);
        return true;
    };
    for_each_leaf(bvh, met, visit_leaf, root);
}

/// The number of hits with one more, and kTouchesBorder.
HWY_INLINE std::uint64_t with_hit(std::uint64_t count, const TriangleHit& hit) {
    return (count + 1) | (may_touch_border(hit.u, hit.v) ? kTouchesBorder : 0);
}

template <class Sees>
HWY_INLINE std::uint64_t count_hits_of(const Bvh& bvh, const Ray& ray, Crossing crossing,
                                       Sees sees) {
    const OneRayStream stream = stream_of_one(ray, crossing);
    std::uint64_t count = 0;
    const auto add = [&](std::uint32_t, const TriangleHit& hit) { count = with_hit(count, hit); };
    for_each_hit(bvh, stream, 0, 0, add, sees);
    return count;
}

// Counted rays go on together below a node if they are more than this many.
inline constexpr std::size_t kCountedTogether = kLanes < 8 ? 4 : 8;

/// Counts the hits of up to 64 rays of one octant.
class CountStream {
public:
    /// rays[order[i]], of one octant: at least one and at most kStreamRays.
    HWY_INLINE CountStream(const Bvh& bvh, const Ray* rays, std::span<const std::uint16_t> order,
                           Crossing crossing)
        : bvh_(bvh), order_(order), stream_(make_stream(rays, order)) {
        stream_.crossing = crossing;
        for (std::size_t i = 0; i < kStreamRays; i += kLanes) store(splat(0u), counts_ + i);
    }

    HWY_INLINE void count(std::uint64_t* counts) {
        if (order_.size() > kCountedTogether) {
            traverse_together(bvh_, stream_, order_.size(), *this);
        } else {
            trace_apart(~std::uint64_t{0} >> (kStreamRays - order_.size()), 0);
        }
        for (std::size_t i = 0; i < order_.size(); ++i) {
            const bool touches = (counts_[i] & kTouches) != 0;
            counts[order_[i]] = (counts_[i] & ~kTouches) | (touches ? kTouchesBorder : 0);
        }
    }

    // For traverse_together().
    static constexpr bool kFrontToBack = false;
    HWY_INLINE const float* last_depths() const { return stream_.last_depth; }
    HWY_INLINE std::uint64_t rays_left(std::uint64_t rays, float) const { return rays; }
    HWY_INLINE bool stay_together(std::uint64_t rays) const {
        return static_cast<std::size_t>(std::popcount(rays)) > kCountedTogether;
    }
    HWY_INLINE void trace_apart(std::uint64_t rays, std::uint32_t child) {
        for (const std::uint32_t ray : BitsOf(rays)) {
            for_each_hit(bvh_, stream_, ray, child,
                         [&](std::uint32_t, const TriangleHit& hit) { add_one(ray, hit); });
        }
    }
    HWY_INLINE void visit_leaf(std::uint64_t rays, const Leaf& leaf) {
        for_rays_of_leaf(
            rays,
            [&](std::size_t first, std::uint32_t active) HWY_ATTR {
                intersect_leaf_together(
                    stream_, first, active, stream_.tfar, leaf,
                    [&](Mask hits, const lanes::TriangleHit& hit, std::uint32_t prim_id)
                        HWY_ATTR { add(first, hits, hit, prim_id); });
            },
            [&](std::size_t ray) HWY_ATTR {
                for_each_hit_of_leaf(
                    bvh_, stream_, ray, stream_.tfar[ray], leaf,
                    [&](std::uint32_t, const TriangleHit& hit) { add_one(ray, hit); });
            });
    }

private:
    /// kTouchesBorder of a count; there are fewer triangles.
    static constexpr std::uint32_t kTouches = 1u << 31;

    HWY_INLINE void add_one(std::size_t ray, const TriangleHit& hit) {
        counts_[ray] = (counts_[ray] + 1) | (may_touch_border(hit.u, hit.v) ? kTouches : 0);
    }
    HWY_INLINE void add(std::size_t first, Mask hits, const lanes::TriangleHit& hit,
                        std::uint32_t prim_id) {
        std::uint32_t times = 1;
        if (!bvh_.repeated.empty())
            times += static_cast<std::uint32_t>(repeats_of(bvh_.repeated, prim_id).size());
        const UintVec more = select(uint_mask(hits), splat(times), splat(0u));
        const Mask touches = hits & lanes::may_touch_border(hit.u, hit.v);
        const UintVec flags = select(uint_mask(touches), splat(kTouches), splat(0u));
        store((load(counts_ + first) + more) | flags, counts_ + first);
    }

    const Bvh& bvh_;
    std::span<const std::uint16_t> order_;
    RayStream stream_;
    alignas(64) std::uint32_t counts_[kStreamRays];
};

inline bool comes_before(const Hit& a, const Hit& b) {
    return is_closer(a.t, a.prim_id, b.t, b.prim_id);
}

/// Keeps the first `most` of the hits from `first` on, in any order.
HWY_NOINLINE inline void keep_first(std::vector<Hit>& hits, std::size_t first, std::size_t most) {
    if (hits.size() - first <= most) return;
    const auto own = std::span(hits).subspan(first);
    std::ranges::nth_element(own, own.begin() + static_cast<std::ptrdiff_t>(most), comes_before);
    hits.resize(first + most);
}

template <class Sees>
HWY_INLINE void list_hits_of(const Bvh& bvh, const Ray& ray, Crossing crossing, std::uint32_t most,
                             HitLists& lists, Sees sees) {
    const OneRayStream stream = stream_of_one(ray, crossing);
    const std::size_t first = lists.hits.size();
    // So that a list that is full costs little: twice as many are kept before the rest is dropped.
    const std::size_t room = 2 * std::size_t{most} + 16;
    std::uint64_t total = 0;
    const auto list = [&](std::uint32_t prim_id, const TriangleHit& hit) {
        total = with_hit(total, hit);
        if (lists.hits.size() - first == room) keep_first(lists.hits, first, most);
        lists.hits.push_back(make_hit(hit, prim_id));
    };
    for_each_hit(bvh, stream, 0, 0, list, sees);
    keep_first(lists.hits, first, most);
    std::ranges::sort(std::span(lists.hits).subspan(first), comes_before);
    lists.listed.push_back(static_cast<std::uint32_t>(lists.hits.size() - first));
    lists.total.push_back(total);
}

/// The first hit after the cursor of a ray whose main axis is kAxis.
template <int kAxis, class Sees>
HWY_NOINLINE Hit next_hit_along(const Bvh& bvh, const auto& stream, const HitCursor& after,
                                Sees sees) {
    Hit first = no_hit();
    first.t = stream.tfar[0];
    float depth = stream.last_depth[0];
    const auto keep = [&](std::uint32_t prim_id, const TriangleHit& hit) {
        if (!is_closer(hit.t, prim_id, first.t, first.prim_id) ||
            !is_closer(after.t, after.prim_id, hit.t, prim_id))
            return;
        first = make_hit(hit, prim_id);
        depth = last_depth(hit.t);
    };
    const auto visit_leaf = [&](const Leaf& leaf) HWY_ATTR {
        for_each_hit_of_leaf<kAxis>(bvh, stream, 0, first.t, leaf, keep, sees);
    };
    const auto skips = [&](const Node& node) { return hides_node(bvh, node, sees); };
    for_each_near_leaf<kAxis>(bvh, stream, 0, depth, visit_leaf, skips);
    return first.prim_id == kNoPrim ? no_hit() : first;
}

template <class Sees>
HWY_INLINE Hit next_hit_of(const Bvh& bvh, Ray ray, Crossing crossing, const HitCursor& after,
                           Sees sees) {
    ray.tnear = std::max(ray.tnear, after.t);
    if (!(ray.tnear <= ray.tfar)) return no_hit();
    const OneRayStream stream = stream_of_one(ray, crossing);
    const std::uint32_t axis = stream.axis[0];
    if (axis == 0) return next_hit_along<0>(bvh, stream, after, sees);
    if (axis == 1) return next_hit_along<1>(bvh, stream, after, sees);
    return next_hit_along<2>(bvh, stream, after, sees);
}

// ---- Boxes and triangles

struct BoxLanes {
    lanes::Float3 lower, upper;
};

/// The boxes in `slot` and the following ones.
HWY_INLINE BoxLanes load_boxes(const Node& node, std::size_t slot) {
    return {
        {planes_of(node, 0, 0, slot), planes_of(node, 1, 0, slot), planes_of(node, 2, 0, slot)},
        {planes_of(node, 0, 1, slot), planes_of(node, 1, 1, slot), planes_of(node, 2, 1, slot)}};
}

HWY_INLINE BoxLanes boxes_of(const lanes::Float3& a, const lanes::Float3& b,
                             const lanes::Float3& c) {
    return {lanes::lesser3(a, lanes::lesser3(b, c)), lanes::greater3(a, lanes::greater3(b, c))};
}

/// Calls visit(slot_of, mask, a, b, c) for each vector of triangles: lane i of those in the mask
/// holds the triangle in slot_of(i), whose vertices are finite.
template <class Visit>
HWY_INLINE void for_each_triangle(const Leaf& leaf, Visit visit) {
    const LeafLanes vertices = load_leaf<2>(leaf, 2);
    const LeafPoints points(vertices, kInPlace);
    for (std::size_t v = 0; v < kVectors; ++v) {
        const VertexLookups at(vertices.local_vertices[v]);
        const auto [a, b, c] = points.look_up(at);
        const Mask used =
            used_lanes(vertices.local_vertices[v], v) & lanes::finite_vertices(a, b, c);
        const auto slot_of = [v](std::uint32_t lane) {
            return slot_of_lane(static_cast<std::uint32_t>(v * kLanes) + lane);
        };
        if (!none(used)) visit(slot_of, used, a, b, c);
    }
}

// ---- Windings

/// Counts the crossings of a point with a leaf's triangles if sees(prim_id) is true for them;
/// uncertain(prim_id) is called for those that floats cannot decide on.
template <class Sees, class Uncertain>
HWY_INLINE void wind_around_leaf(const Bvh& bvh, const Leaf& leaf, const lanes::Float3& p,
                                 FloatWinding& winding, Sees sees, Uncertain uncertain) {
    for_each_triangle(leaf, [&](auto slot_of, Mask used, const lanes::Float3& a,
                                const lanes::Float3& b, const lanes::Float3& c) HWY_ATTR {
        const lanes::FloatCrossing crossing = lanes::float_crossing(p, a, b, c);
        const auto for_each_prim = [&](Mask of, auto visit) HWY_ATTR {
            for (const std::uint32_t lane : BitsOf(bits_of(of & used))) {
                const std::uint32_t prim_id = leaf.prim_id[slot_of(lane)];
                if (sees(prim_id)) visit(prim_id);
                for (const RepeatedTriangle& repeat : repeats_of(bvh.repeated, prim_id))
                    if (sees(repeat.prim_id)) visit(repeat.prim_id);
            }
        };
        const auto count_of = [&](Mask of) HWY_ATTR {
            if (kSeesAll<Sees> && bvh.repeated.empty()) [[likely]]
                return static_cast<std::int32_t>(count(of & used));
            std::int32_t seen = 0;
            for_each_prim(of, [&](std::uint32_t) { ++seen; });
            return seen;
        };
        const std::int32_t up = count_of(crossing.is_up), down = count_of(crossing.is_down);
        winding.winding += up - down;
        winding.crossings += static_cast<std::uint32_t>(up + down);
        for_each_prim(crossing.is_uncertain, uncertain);
    });
}

/// Adds the number of leaves visited to `leaves`.
template <class Sees, class Uncertain>
HWY_INLINE FloatWinding wind_around(const Bvh& bvh, vec3 point, std::size_t& leaves, Sees sees,
                                    Uncertain uncertain) {
    FloatWinding winding;
    const lanes::Float3 p(clipped_point(point));
    const auto met = [&](const Node& node) HWY_ATTR {
        if (hides_node(bvh, node, sees)) return 0u;
        return bits_of_sixteen([&](std::size_t slot) HWY_ATTR {
            const BoxLanes boxes = load_boxes(node, slot);
            return lanes::may_cross_in(p, boxes.lower, boxes.upper);
        });
    };
    for_each_leaf(bvh, met, [&](const Leaf& leaf) HWY_ATTR {
        ++leaves;
        if (hides_leaf(bvh, leaf, sees)) return true;
        wind_around_leaf(bvh, leaf, p, winding, sees, uncertain);
        return true;
    });
    return winding;
}

/// Windings around points above each other, one a lane: they share nodes and leaves.
class WindingBundle {
public:
    /// `points`, at most kLanes, come from clipped_point(). Lanes without a point have the last
    /// one.
    HWY_INLINE explicit WindingBundle(std::span<const vec3> points)
        : used_(mask_of((1u << points.size()) - 1)) {
        HWY_ALIGN float values[3][kLanes];
        for (std::size_t i = 0; i < kLanes; ++i) {
            const vec3& point = points[std::min(i, points.size() - 1)];
            for (int axis = 0; axis < 3; ++axis) values[axis][i] = point[axis];
        }
        p_ = {load(values[0]), load(values[1]), load(values[2])};
        lower_ = {hn::MinOfLanes(kFloats, p_.x), hn::MinOfLanes(kFloats, p_.y),
                  hn::MinOfLanes(kFloats, p_.z)};
        upper_ = {hn::MaxOfLanes(kFloats, p_.x), hn::MaxOfLanes(kFloats, p_.y),
                  hn::MaxOfLanes(kFloats, p_.z)};
    }

    /// Calls uncertain(i, prim_id) where floats cannot decide. False: gave up after `most_leaves`.
    template <class Uncertain>
    HWY_INLINE bool search(const Bvh& bvh, std::size_t most_leaves, Uncertain uncertain) {
        const auto met = [&](const Node& node) HWY_ATTR {
            return bits_of_sixteen([&](std::size_t slot)
                                       HWY_ATTR { return may_cross_in(load_boxes(node, slot)); });
        };
        std::size_t leaves = 0;
        return for_each_leaf(bvh, met, [&](const Leaf& leaf) HWY_ATTR {
            if (++leaves > most_leaves) return false;
            wind_around_leaf(bvh, leaf, uncertain);
            return true;
        });
    }

    HWY_INLINE void store_windings(std::span<FloatWinding> windings) const {
        HWY_ALIGN std::int32_t winding[kLanes], crossings[kLanes];
        store(winding_, winding);
        store(crossings_, crossings);
        for (std::size_t i = 0; i < windings.size(); ++i)
            windings[i] = {winding[i], static_cast<std::uint32_t>(crossings[i])};
    }

private:
    /// The boxes in which a triangle may be that the half-line of a point crosses: rounding is
    /// monotone, so the outermost points decide for all (may_cross_in()).
    HWY_INLINE Mask may_cross_in(const BoxLanes& boxes) const {
        const FloatVec most = splat(kCoordinateError);
        const FloatVec least = splat(-kCoordinateError);
        return (boxes.lower.x - upper_.x <= most) & (boxes.upper.x - lower_.x >= least) &
               (boxes.lower.y - upper_.y <= most) & (boxes.upper.y - lower_.y >= least) &
               (boxes.upper.z - lower_.z >= least);
    }

    template <class Uncertain>
    HWY_INLINE void wind_around_leaf(const Bvh& bvh, const Leaf& leaf, Uncertain& uncertain) {
        for_each_triangle(leaf, [&](auto slot_of, Mask used, const lanes::Float3& a,
                                    const lanes::Float3& b, const lanes::Float3& c) HWY_ATTR {
            const Mask met = used & may_cross_in(boxes_of(a, b, c));
            for (const std::uint32_t lane : BitsOf(bits_of(met)))
                wind_around(bvh, leaf, slot_of(lane), uncertain);
        });
    }

    template <class Uncertain>
    HWY_INLINE void wind_around(const Bvh& bvh, const Leaf& leaf, std::uint32_t slot,
                                Uncertain& uncertain) {
        const TriangleCorners t = corners_in_lanes(leaf, slot);
        const lanes::FloatCrossing crossing = lanes::float_crossing(p_, t.a, t.b, t.c);
        const std::uint32_t prim_id = leaf.prim_id[slot];
        const auto repeats = repeats_of(bvh.repeated, prim_id);
        const IntVec times = splat(static_cast<std::int32_t>(1 + repeats.size()));
        const auto times_where = [&](Mask m) HWY_ATTR {
            return hn::IfThenElseZero(hn::RebindMask(kInts, m), times);
        };
        const IntVec up = times_where(crossing.is_up);
        const IntVec down = times_where(crossing.is_down);
        winding_ = winding_ + up - down;
        crossings_ = crossings_ + up + down;
        for (const std::uint32_t point : BitsOf(bits_of(crossing.is_uncertain & used_))) {
            uncertain(point, prim_id);
            for (const RepeatedTriangle& repeat : repeats) uncertain(point, repeat.prim_id);
        }
    }

    /// The points, and the corners of their box in all lanes.
    lanes::Float3 p_, lower_, upper_;
    Mask used_;
    IntVec winding_ = hn::Zero(kInts);
    IntVec crossings_ = hn::Zero(kInts);
};

// ---- Closest triangles
//
// A lower bound of the distance of a triangle from a point is much cheaper than the rule: the
// offset r of each place of the triangle is at least r.w / |w| long for any w, and r.w is least at
// a vertex. w is the offset of the nearest vertex, or that of a place, or a normal. The constants
// cover rounding, that of the rule as well (lab/proofs/closest.g), so that bounds may be fused.

HWY_INLINE FloatVec fused_dot(const lanes::Float3& a, const lanes::Float3& b) {
    return mul_add(a.x, b.x, mul_add(a.y, b.y, a.z * b.z));
}

/// Where the rule may give d2 or less for a point and the triangle a, b, c, relative to it. size:
/// the largest coordinate.
HWY_INLINE Mask may_be_within(const lanes::Float3& a, const lanes::Float3& b,
                              const lanes::Float3& c, FloatVec size, FloatVec d2) {
    const FloatVec error2 = mul_add(size * size, splat(kNearestVertexErrorSquare),
                                    splat(kLeastNearestVertexErrorSquare));
    const FloatVec a2 = fused_dot(a, a);
    const FloatVec b2 = fused_dot(b, b);
    const FloatVec c2 = fused_dot(c, c);
    const FloatVec ab2 = min(a2, b2);
    const FloatVec w2 = min(ab2, c2);
    const lanes::Float3 w = select(c2 < ab2, c, select(b2 < a2, b, a));
    const FloatVec along = max(min3(fused_dot(w, a), fused_dot(w, b), fused_dot(w, c)), zero());
    const FloatVec limit = mul_add(d2, splat(kNearestVertexRounding), error2);
    return along * along <= w2 * limit;
}

HWY_INLINE lanes::Float3 fused_cross(const lanes::Float3& a, const lanes::Float3& b) {
    return {mul_sub(a.y, b.z, a.z * b.y), mul_sub(a.z, b.x, a.x * b.z),
            mul_sub(a.x, b.y, a.y * b.x)};
}

/// a + s e
HWY_INLINE lanes::Float3 fused_sum(const lanes::Float3& a, FloatVec s, const lanes::Float3& e) {
    return {mul_add(s, e.x, a.x), mul_add(s, e.y, a.y), mul_add(s, e.z, a.z)};
}

/// Bounds of the distance of a triangle, but for their rounding.
struct DistanceBounds {
    FloatVec least, most;
};

/// The distance of a triangle along w, which may have any direction, from below.
HWY_INLINE FloatVec least_along(const lanes::Float3& w, const lanes::Float3& a,
                                const lanes::Float3& b, const lanes::Float3& c) {
    const FloatVec to_a = fused_dot(w, a), to_b = fused_dot(w, b), to_c = fused_dot(w, c);
    const FloatVec along = max3(min3(to_a, to_b, to_c), -max3(to_a, to_b, to_c), zero());
    return along / max(hn::Sqrt(fused_dot(w, w)), splat(kTiny));
}

/// The corner that is nearest to the point, and where it is surely the closest place of its
/// triangle: both edges lead away from the point.
struct NearestCorner {
    Mask is_b, is_c, is_place;
};

/// For the triangle a, b, c, relative to a point that is off by less than `error`, as products are.
HWY_INLINE NearestCorner nearest_corner(const lanes::Float3& a, const lanes::Float3& b,
                                        const lanes::Float3& c, FloatVec error) {
    const FloatVec a2 = fused_dot(a, a), b2 = fused_dot(b, b), c2 = fused_dot(c, c);
    const Mask is_c = c2 < min(a2, b2);
    const Mask is_b = b2 < a2;
    const auto choose =
        [&](const lanes::Float3& of_a, const lanes::Float3& of_b, const lanes::Float3& of_c)
            HWY_ATTR { return select(is_c, of_c, select(is_b, of_b, of_a)); };
    const lanes::Float3 w = choose(a, b, c);
    const auto leads_away = [&](const lanes::Float3& edge) HWY_ATTR {
        const FloatVec along = fused_dot(w, edge);
        return (along > zero()) & (along * along > error * error * fused_dot(edge, edge));
    };
    return {is_b, is_c, leads_away(choose(b, c, a) - w) & leads_away(choose(c, a, b) - w)};
}

/// The bounds for the triangle a, b, c, relative to the point. `most` is the distance of the
/// nearest of four places: on each edge and inside, as floats find them. `least` is along the
/// nearest edge's place, or along the normal where there is a place inside.
HWY_INLINE DistanceBounds distance_bounds(const lanes::Float3& a, const lanes::Float3& b,
                                          const lanes::Float3& c) {
    const FloatVec least_square = splat(kTiny * kTiny);
    const FloatVec one = splat(1.0f);
    const auto on_edge = [&](const lanes::Float3& p, const lanes::Float3& e) HWY_ATTR {
        const FloatVec at = -fused_dot(p, e) / max(fused_dot(e, e), least_square);
        return fused_sum(p, min(max(at, zero()), one), e);
    };
    const lanes::Float3 ab = b - a, ca = a - c;
    lanes::Float3 w = on_edge(a, ab);
    FloatVec d2 = fused_dot(w, w);
    for (const lanes::Float3& place : {on_edge(b, c - b), on_edge(c, ca)}) {
        const FloatVec place2 = fused_dot(place, place);
        w = select(place2 < d2, place, w);
        d2 = min(d2, place2);
    }
    const lanes::Float3 normal = fused_cross(ca, ab);
    const FloatVec scale = one / max(fused_dot(normal, normal), least_square);
    const FloatVec of_b = fused_dot(a, fused_cross(ca, normal)) * scale;
    const FloatVec of_c = fused_dot(a, fused_cross(ab, normal)) * scale;
    const FloatVec of_a = one - (of_b + of_c);
    const lanes::Float3 inside = fused_sum(fused_sum(lanes::scaled_by(a, of_a), of_b, b), of_c, c);
    const Mask is_inside = min3(of_a, of_b, of_c) > zero();
    d2 = select(is_inside, min(d2, fused_dot(inside, inside)), d2);
    w = select(is_inside, normal, w);
    return {least_along(w, a, b, c), hn::Sqrt(d2)};
}

/// The triangles that may exactly be the closest ones of points, for one point after the other.
struct Rivals {
    std::vector<NumberedTriangle> triangles;
    /// Where those of each point end. A point that has too many gets one with kNoPrim.
    std::vector<std::uint32_t> ends;
};

/// The exactly closest triangle that the point p sees, one of `rivals` if p is_within(); or
/// kNoPrim.
template <class Sees>
NumberedTriangle closest_of(const Bvh& bvh, const dvec3& p,
                            std::span<const NumberedTriangle> rivals, Sees sees) {
    if (is_within(p)) {
        if (rivals.empty()) return {kNoPrim, {}};
        if (rivals.front().prim_id != kNoPrim) return exact_closest(p, rivals);
    }
    if constexpr (kSeesAll<Sees>) return exact_closest(bvh, p);
    return exact_closest(bvh, p, sees);
}

/// The triangles near a point, among which the closest one is.
class NearTriangles {
public:
    /// Adds the triangle in a slot of a leaf; `least` is a lower bound of its distance. Triangles
    /// whose bound is above `most` may be dropped.
    HWY_INLINE void add(float least, std::uint32_t leaf, std::uint32_t slot, float most) {
        if (near_.size() == kMost && least_lost_ <= most) return;
        if (near_.size() >= room_) {
            keep_within(most);
            room_ = std::clamp(2 * near_.size(), kFew, kMost);
        }
        if (near_.size() < kMost) {
            near_.push_back({least, triangle_at(leaf, slot)});
        } else {
            least_lost_ = least;
        }
    }
    bool are_many() const { return near_.size() > kFew / 4; }
    void clear() {
        near_.clear();
        room_ = kFew;
        least_lost_ = std::numeric_limits<float>::infinity();
    }

    /// Appends the triangles whose bound is at most `most`; of many the closest one to the point p,
    /// or kNoPrim if they were too many.
    template <class Sees>
    HWY_INLINE void append_to(Rivals& rivals, const Bvh& bvh, float most, const dvec3& p,
                              Sees sees) {
        keep_within(most);
        if (least_lost_ <= most) {
            rivals.triangles.push_back({kNoPrim, {}});
            return;
        }
        const std::size_t first = rivals.triangles.size();
        for (const Near& near : near_) {
            rivals.triangles.push_back(
                triangle_of(bvh.leaves[triangle_leaf(near.place)], triangle_slot(near.place)));
            std::uint32_t& prim_id = rivals.triangles.back().prim_id;
            prim_id = first_seen(bvh, prim_id, sees);
        }
        if (near_.size() <= kFew) return;
        const NumberedTriangle closest =
            exact_closest(p, std::span(rivals.triangles).subspan(first));
        rivals.triangles.resize(first);
        rivals.triangles.push_back(closest);
    }

private:
    static constexpr std::size_t kFew = 64;
    static constexpr std::size_t kMost = std::size_t{1} << 20;
    struct Near {
        float least;
        std::uint32_t place;
    };

    HWY_INLINE void keep_within(float most) {
        std::erase_if(near_, [&](const Near& near) { return !(near.least <= most); });
    }

    std::vector<Near> near_;
    std::size_t room_ = kFew;
    float least_lost_ = std::numeric_limits<float>::infinity();
};

/// Searches for the closest triangle to a point by the rule; or else for its rivals, the triangles
/// that may exactly be the closest one, which needs no rule.
template <bool kFindsRivals, class Sees>
class ClosestSearch {
public:
    /// Triangles whose squared distance by the rule is above `most_d2` need not be found. Those
    /// without sees(prim_id) do not exist.
    /// `near` is empty.
    HWY_INLINE ClosestSearch(vec3 point, float most_d2, Sees sees, NearTriangles& near)
        : p_(point), most_d2_(most_d2), most_(most_d2), near_(near), sees_(sees) {
        if constexpr (!kFindsRivals) return;
        const FloatVec farthest = lanes::largest_component(p_);
        point_error_ = splat(kPointRounding) * (farthest + splat(1.0f));
        // No corner is farther on an axis.
        set_most(most_of(hn::Sqrt(splat(most_d2)), farthest + splat(kSceneExtent)));
    }

    /// Visits the leaf `near_leaf` first. It is the leaf of the answer for the point before, and
    /// becomes that of the answer for this point.
    HWY_INLINE void search(const Bvh& bvh, std::uint32_t& near_leaf) {
        const std::uint32_t first_leaf = near_leaf;
        if (first_leaf < bvh.leaves.size()) search_leaf(bvh, first_leaf);
        const auto near = [&](const Node& node, float* HWY_RESTRICT d2) HWY_ATTR {
            if (hides_node(bvh, node, sees_)) return 0u;
            const FloatVec most_d2 = splat(most_d2_);
            return bits_of_sixteen([&](std::size_t slot) HWY_ATTR {
                const BoxLanes boxes = load_boxes(node, slot);
                const FloatVec distances2 = lanes::box_distance2(p_, boxes.lower, boxes.upper);
                store(distances2, d2 + slot);
                return distances2 <= most_d2;
            });
        };
        for_each_near_leaf(bvh, most_d2_, near, [&](std::uint32_t leaf) HWY_ATTR {
            if (leaf == first_leaf || hides_leaf(bvh, bvh.leaves[leaf], sees_)) return;
            const float before = most_d2_;
            search_leaf(bvh, leaf);
            if (most_d2_ < before) near_leaf = leaf;
        });
    }

    ClosestTriangle closest() const { return {most_d2_, prim_id_}; }
    HWY_INLINE void append_to(Rivals& rivals, const Bvh& bvh, const dvec3& p) {
        if (of_vertex_.prim_id != kNoPrim) add(of_vertex_);
        near_.append_to(rivals, bvh, most_, p, sees_);
        rivals.ends.push_back(static_cast<std::uint32_t>(rivals.triangles.size()));
    }

private:
    /// An upper bound of the exact distances of triangles, by the distances of places on them and
    /// the largest coordinates relative to the point.
    HWY_INLINE FloatVec most_of(FloatVec d, FloatVec size) const {
        return d + splat(kRuleDefect) * size + point_error_;
    }

    HWY_INLINE void set_most(FloatVec most) {
        most_ = hn::GetLane(most);
        most_d2_ = hn::GetLane(most * most * splat(kRivalRounding));
    }

    /// A triangle whose closest place is this vertex.
    struct OfVertex {
        vec3 vertex;
        float least;
        std::uint32_t leaf, slot;
        std::uint32_t prim_id = kNoPrim;
    };
    HWY_INLINE void add(const OfVertex& one) { near_.add(one.least, one.leaf, one.slot, most_); }
    /// Triangles around a vertex are as far: one of them, the lowest, stands for all.
    HWY_INLINE void add_at_vertex(const OfVertex& one) {
        if (one.vertex == of_vertex_.vertex) {
            if (one.prim_id < of_vertex_.prim_id) of_vertex_ = one;
            return;
        }
        if (of_vertex_.prim_id != kNoPrim) add(of_vertex_);
        of_vertex_ = one;
    }

    HWY_INLINE void search_leaf(const Bvh& bvh, std::uint32_t index) {
        const Leaf& leaf = bvh.leaves[index];
        ++leaves_;
        for_each_triangle(leaf, [&](auto slot_of, Mask used, const lanes::Float3& a,
                                    const lanes::Float3& b, const lanes::Float3& c) HWY_ATTR {
            const FloatVec most_d2 = splat(most_d2_);
            const BoxLanes boxes = boxes_of(a, b, c);
            const FloatVec box = lanes::box_distance2(p_, boxes.lower, boxes.upper);
            Mask near = used & (box <= most_d2);
            if (none(near)) return;
            const lanes::Float3 to_a = a - p_;
            const lanes::Float3 to_b = b - p_;
            const lanes::Float3 to_c = c - p_;
            const FloatVec size =
                max3(lanes::largest_component(to_a), lanes::largest_component(to_b),
                     lanes::largest_component(to_c));
            near = near & may_be_within(to_a, to_b, to_c, size, most_d2);
            if (leaves_ > kManyLeaves) {
                // Planes tell apart what is about as far. The second term covers bound and rule
                // (lab/proofs/closest.g).
                const FloatVec plane =
                    least_along(fused_cross(to_a - to_c, to_b - to_a), to_a, to_b, to_c);
                near = near & (plane <= hn::Sqrt(most_d2) + splat(2 * kRuleExcess) * size);
            }
            if (none(near)) return;
            const auto for_each_of = [&](Mask lanes, FloatVec value, auto use) HWY_ATTR {
                HWY_ALIGN float values[kLanes];
                store(value, values);
                for (const std::uint32_t i : BitsOf(bits_of(lanes))) {
                    const std::uint32_t slot = slot_of(i);
                    const std::uint32_t prim_id = first_seen(bvh, leaf.prim_id[slot], sees_);
                    if (kSeesAll<Sees> || prim_id != kNoPrim) use(i, slot, prim_id, values[i]);
                }
            };
            if constexpr (kFindsRivals) {
                const DistanceBounds bounds = distance_bounds(to_a, to_b, to_c);
                const FloatVec least = bounds.least - splat(kRuleExcess) * size;
                near = near & (least <= splat(most_));
                if constexpr (!kSeesAll<Sees>) {
                    std::uint32_t seen = 0;
                    for_each_of(near, least, [&](std::uint32_t i, auto...) { seen |= 1u << i; });
                    near = mask_of(seen);
                }
                if (none(near)) return;
                const FloatVec most = select(near, most_of(bounds.most, size), splat(most_));
                set_most(hn::MinOfLanes(kFloats, min(most, splat(most_))));
                near = near & (least <= splat(most_));
                if (near_.are_many()) {
                    const NearestCorner nearest =
                        nearest_corner(to_a, to_b, to_c, splat(kRuleExcess) * size + point_error_);
                    const lanes::Float3 vertex =
                        select(nearest.is_c, c, select(nearest.is_b, b, a));
                    HWY_ALIGN float at[3][kLanes];
                    store3(vertex, at, 0);
                    for_each_of(near & nearest.is_place, least,
                                [&](std::uint32_t i, std::uint32_t slot, std::uint32_t prim_id,
                                    float value) HWY_ATTR {
                                    add_at_vertex({vec3(at[0][i], at[1][i], at[2][i]), value, index,
                                                   slot, prim_id});
                                });
                    near = hn::AndNot(nearest.is_place, near);
                }
                for_each_of(near, least, [&](auto, std::uint32_t slot, auto, float value) HWY_ATTR {
                    near_.add(value, index, slot, most_);
                });
            } else {
                const FloatVec d2 = lanes::triangle_distance2(p_, a, b, c);
                for_each_of(near & (d2 <= most_d2), d2,
                            [&](auto, auto, std::uint32_t prim_id, float value) HWY_ATTR {
                                if (!is_closer(value, prim_id, most_d2_, prim_id_)) return;
                                most_d2_ = value;
                                prim_id_ = prim_id;
                            });
            }
        });
    }

    lanes::Float3 p_;
    /// Without rivals the squared distance of the closest triangle so far. Else the exactly closest
    /// one is no farther than most_, and its square is rounded up.
    float most_d2_, most_;
    std::uint32_t prim_id_ = kNoPrim;
    FloatVec point_error_;
    std::size_t leaves_ = 0;
    static constexpr std::size_t kManyLeaves = 32;
    NearTriangles& near_;
    OfVertex of_vertex_ = {};
    [[no_unique_address]] Sees sees_;
};

// ---- Answers

void answer(const Bvh& bvh, const CountQuery& query) {
    const std::span<const Ray> rays = query.rays;
    if (rays.size() <= kCountedTogether || query.filter != nullptr) {
        for_each_asked(query, rays.size(), [&](std::size_t i, auto sees) HWY_ATTR {
            query.counts[i] = count_hits_of(bvh, rays[i], query.crossing, sees);
        });
        return;
    }
    for_each_stream(rays, [&](const Ray* batch, std::span<const std::uint16_t> order,
                              std::size_t first) HWY_ATTR {
        query.watch.throw_if_cancelled();
        CountStream(bvh, batch, order, query.crossing).count(&query.counts[first]);
    });
}

void answer(const Bvh& bvh, const ListQuery& query) {
    for_each_asked(query, query.rays.size(), [&](std::size_t i, auto sees) HWY_ATTR {
        list_hits_of(bvh, query.rays[i], query.crossing, query.most, query.lists, sees);
    });
}

void answer(const Bvh& bvh, const NextQuery& query) {
    for_each_asked(query, query.rays.size(), [&](std::size_t i, auto sees) HWY_ATTR {
        query.hits[i] = next_hit_of(bvh, query.rays[i], query.crossing, query.after[i], sees);
    });
}

/// Whether bundles pay, by the leaves that they and single points have visited so far.
class BundleChoice {
public:
    /// Whether the next points are to be tried as a bundle.
    bool tries() {
        if (wait_ == 0) return true;
        --wait_;
        return false;
    }
    /// The leaves that a bundle may visit before it is given up: about as many as 7 points do,
    /// which take as long one after the other.
    std::size_t most_leaves() const { return static_cast<std::size_t>(7 * leaves_of_point_); }
    void succeeded() { next_wait_ = kFirstWait; }
    void gave_up() {
        wait_ = next_wait_;
        next_wait_ = std::min<std::size_t>(2 * next_wait_, 48);
    }
    /// After `points` without a bundle that visited so many leaves.
    void add(std::size_t points, std::size_t leaves) {
        const float now = static_cast<float>(leaves) / static_cast<float>(points);
        leaves_of_point_ += 0.5f * (now - leaves_of_point_);
    }

private:
    static constexpr std::size_t kFirstWait = 3;

    float leaves_of_point_ = 4;
    std::size_t wait_ = 0, next_wait_ = kFirstWait;
};

void answer(const Bvh& bvh, const WindingQuery& query) {
    const std::span<const vec3> points = query.points;
    std::vector<UncertainCrossing>& uncertain = query.uncertain;
    const auto add_uncertain = [&](std::size_t point, std::uint32_t prim_id) {
        uncertain.push_back({static_cast<std::uint32_t>(point), prim_id});
    };
    std::size_t leaves = 0;
    const auto wind = [&](std::size_t i, auto sees) {
        query.windings[i] = wind_around(bvh, points[i], leaves, sees,
                                        [&](std::uint32_t prim_id) { add_uncertain(i, prim_id); });
    };
    // Returns false for a bundle that was given up.
    const auto wind_together = [&](std::size_t first, std::size_t count, std::size_t most_leaves) {
        vec3 clipped[kLanes];
        for (std::size_t i = 0; i < count; ++i) clipped[i] = clipped_point(points[first + i]);
        const std::size_t before = uncertain.size();
        WindingBundle search(std::span<const vec3>(clipped, count));
        const bool found = search.search(
            bvh, most_leaves,
            [&](std::size_t i, std::uint32_t prim_id) { add_uncertain(first + i, prim_id); });
        if (found) {
            search.store_windings(query.windings.subspan(first, count));
        } else {
            uncertain.resize(before);
        }
        return found;
    };
    // Calls about fewer points come in any order, and their bundles would be wide.
    constexpr std::size_t kManyPoints = 256;
    if (kLanes > 1 && points.size() >= kManyPoints && query.filter == nullptr) {
        BundleChoice choice;
        for (std::size_t first = 0; first < points.size(); first += kLanes) {
            query.watch.throw_if_cancelled();
            const std::size_t count = std::min<std::size_t>(kLanes, points.size() - first);
            if (choice.tries()) {
                if (wind_together(first, count, choice.most_leaves())) {
                    choice.succeeded();
                    continue;
                }
                choice.gave_up();
            }
            leaves = 0;
            for (std::size_t i = first; i < first + count; ++i) wind(i, SeesAll{});
            choice.add(count, leaves);
        }
        return;
    }
    for_each_asked(query, points.size(), wind);
}

void answer(const Bvh& bvh, const ClosestQuery& query) {
    std::uint32_t near_leaf = kNoPrim;
    NearTriangles near;
    for_each_asked(query, query.points.size(), [&](std::size_t i, auto sees) HWY_ATTR {
        ClosestSearch<false, decltype(sees)> search(query.points[i], query.most_d2, sees, near);
        search.search(bvh, near_leaf);
        query.closest[i] = search.closest();
    });
}

/// The rivals of all points are found before one of each is chosen, which takes other memory.
void answer(const Bvh& bvh, const ExactClosestQuery& query) {
    Rivals rivals;
    rivals.triangles.reserve(query.points.size());
    std::uint32_t near_leaf = kNoPrim;
    NearTriangles near;
    for_each_asked(query, query.points.size(), [&](std::size_t i, auto sees) HWY_ATTR {
        near.clear();
        ClosestSearch<true, decltype(sees)> search(query.points[i], query.most_d2, sees, near);
        search.search(bvh, near_leaf);
        search.append_to(rivals, bvh, query.exact[i]);
    });
    std::size_t first = 0;
    for_each_asked(query, query.points.size(), [&](std::size_t i, auto sees) HWY_ATTR {
        const auto own = std::span(rivals.triangles).subspan(first, rivals.ends[i] - first);
        first = rivals.ends[i];
        query.closest[i] = closest_of(bvh, query.exact[i], own, sees);
    });
}

void answer_batch(const Bvh& bvh, const QueryBatch& batch) {
    std::visit([&](const auto& query) HWY_ATTR { answer(bvh, query); }, batch);
}

}  // namespace mray::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE

#include "common/simd/simd_dispatch-inl.h"

namespace mray::cpu {

HWY_EXPORT(answer_batch);

TreeQueries::TreeQueries(const Bvh& bvh, SimdTarget target)
    : bvh_(&bvh), answer_(SIMD_FUNCTION(answer_batch, target)) {}

}  // namespace mray::cpu

#endif  // HWY_ONCE
