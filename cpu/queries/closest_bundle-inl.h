// Closest triangles of points that are near each other, one in each lane. They share nodes and
// leaves, and the rule is asked about those pairs of a point and a triangle alone that a lower
// bound leaves open, kLanes of them at a time.
#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>

#include "common/bvh/bvh.h"
#include "common/scene_queries.h"
#include "cpu/queries/closest_search-inl.h"
#include "cpu/queries/points-inl.h"

HWY_BEFORE_NAMESPACE();
namespace mray::cpu {
namespace HWY_NAMESPACE {
using namespace simd::HWY_NAMESPACE;

#if HWY_TARGET != HWY_SCALAR

/// Pairs of a point of a bundle and a triangle that wait until bounds are better.
struct PointPairs {
    static constexpr std::size_t kMost = 512;
    // A whole vector is written for a few pairs.
    float bound[kMost + kLanes];
    /// The point's lane, and the triangle's slot times kMaxLanes.
    std::uint32_t lane_and_slot[kMost + kLanes];
    std::uint32_t leaf[kMost + kLanes];
    std::size_t count = 0;
};

/// Points and triangles in lanes, to ask the rule about.
struct AskedPairs {
    enum { kPoint = 3 };
    /// The vertices, and the point.
    HWY_ALIGN float corners[4][3][kLanes] = {};
    std::uint32_t lane[kLanes];
    std::uint32_t slot[kLanes];
    std::uint32_t leaf[kLanes];
    std::uint32_t count = 0;

    HWY_INLINE void set(int corner, const vec3& p) {
        for (int axis = 0; axis < 3; ++axis) corners[corner][axis][count] = p[axis];
    }
    HWY_INLINE lanes::Float3 get(int corner) const {
        return {load(corners[corner][0]), load(corners[corner][1]), load(corners[corner][2])};
    }
};

/// At most kLanes points, and the closest triangle of each so far.
class ClosestBundle {
public:
    /// It begins with `near_leaf`, that of points nearby, and sets it. Arguments must outlive it.
    HWY_INLINE ClosestBundle(const Bvh& bvh, std::span<const vec3> points,
                             std::span<const ClosestTriangle> closest, std::uint32_t& near_leaf)
        : bvh_(bvh), asked_(points), near_leaf_(near_leaf), points_(points) {
        centre_ = lanes::Float3(points[0]);
        from_centre_ = points_.p - centre_;
        extent_ = hn::MaxOfLanes(kFloats, lanes::largest_component(from_centre_));
        is_used_ = mask_of((1u << points.size()) - 1);
        margin_ = rival_margin(points_.p);
        HWY_ALIGN float d2[kLanes] = {};
        HWY_ALIGN std::uint32_t prim_id[kLanes] = {};
        for (std::size_t i = 0; i < closest.size(); ++i) {
            d2[i] = closest[i].d2;
            prim_id[i] = closest[i].prim_id;
        }
        set_closest(load(d2), load(prim_id));
    }

    /// Looks for closer triangles in all leaves. Returns false if it gave up after `most_leaves`.
    HWY_INLINE bool search(std::size_t most_leaves) {
        const std::uint32_t first_leaf = near_leaf_;
        if (first_leaf < bvh_.leaves.size()) ask_leaf(first_leaf);
        std::size_t leaves = 0;
        Entry stack[kMaxStack];
        std::size_t size = push_near(0, stack, 0);
        while (size > 0) {
            const Entry entry = stack[--size];
            if (entry.t_least > hn::GetLane(most_of_all_)) continue;
            const Node& node = bvh_.nodes[entry.node];
            if (!is_near(node, entry.slot)) continue;
            const std::uint32_t child = node.child[entry.slot];
            if ((child & kLeafBit) == 0) {
                size = push_near(child, stack, size);
            } else if (const std::uint32_t leaf = child & ~kLeafBit; leaf != first_leaf) {
                if (++leaves > most_leaves) return false;
                ask_leaf(leaf);
            }
        }
        ask_pairs();
        return true;
    }

    /// Sets the closest triangles found.
    HWY_INLINE void store_closest(std::span<ClosestTriangle> closest) const {
        const StoredClosest found(*this);
        for (std::size_t i = 0; i < closest.size(); ++i)
            closest[i] = {found.d2[i], found.prim_id[i]};
    }

    HWY_INLINE void append_to(Rivals& rivals) {
        const StoredClosest found(*this);
        for (std::size_t i = 0; i < asked_.size(); ++i) {
            if (found.prim_id[i] != kNoPrim) near_[i].append_to(rivals, bvh_, found.most_d2[i]);
            rivals.ends.push_back(static_cast<std::uint32_t>(rivals.triangles.size()));
        }
    }

private:
    struct Entry {
        float t_least;
        std::uint32_t node;
        std::uint32_t slot;
    };

    /// The closest triangles in memory.
    struct StoredClosest {
        HWY_ALIGN float d2[kLanes];
        HWY_ALIGN float most_d2[kLanes];
        HWY_ALIGN std::uint32_t prim_id[kLanes];

        HWY_INLINE explicit StoredClosest(const ClosestBundle& bundle) {
            store(bundle.d2_, d2);
            store(bundle.most_d2_, most_d2);
            store(bundle.prim_id_, prim_id);
        }
    };

    HWY_INLINE void set_closest(FloatVec d2, UintVec prim_id) {
        d2_ = d2;
        prim_id_ = prim_id;
        most_d2_ = select(is_used_, most_of_rivals(d2, margin_), -1.0f);
        most_of_all_ = hn::MaxOfLanes(kFloats, most_d2_);
    }

    /// The squared distances of boxes from the box of all points: not above that of any point.
    HWY_INLINE FloatVec box_distance2(const BoxLanes& boxes) const {
        const lanes::Float3 zero3(zero(), zero(), zero());
        const lanes::Float3 d = lanes::greater3(
            lanes::greater3(boxes.lower - points_.upper, points_.lower - boxes.upper), zero3);
        return lanes::dot3(d, d);
    }

    /// Whether a child's box is near enough to a point.
    HWY_INLINE bool is_near(const Node& node, std::uint32_t slot) const {
        const lanes::Float3 lower(vec3(node.lower_x[slot], node.lower_y[slot], node.lower_z[slot]));
        const lanes::Float3 upper(vec3(node.upper_x[slot], node.upper_y[slot], node.upper_z[slot]));
        return !none(lanes::box_distance2(points_.p, lower, upper) <= most_d2_);
    }

    /// Pushes the children that may be near enough; returns the new size.
    HWY_INLINE std::size_t push_near(std::uint32_t index, Entry* stack, std::size_t size) const {
        const Node& node = bvh_.nodes[index];
        HWY_ALIGN float d2[kWidth];
        const auto distance2 = [&](const BoxLanes& boxes) HWY_ATTR { return box_distance2(boxes); };
        std::uint32_t slots = slots_within(node, most_of_all_, distance2, d2);
        const std::size_t base = size;
        for (; slots != 0; slots &= slots - 1) {
            const auto slot = static_cast<std::uint32_t>(std::countr_zero(slots));
            insert_sorted(stack, base, size++, Entry{d2[slot], index, slot});
        }
        return size;
    }

    HWY_INLINE void ask_leaf(std::uint32_t index) {
        const Leaf& leaf = bvh_.leaves[index];
        for_each_triangle(leaf, [&](auto slot_of, Mask used, const lanes::Float3& a,
                                    const lanes::Float3& b, const lanes::Float3& c) HWY_ATTR {
            const FloatVec box = box_distance2(boxes_of(a, b, c));
            const std::uint32_t near = bits_of(used & (box <= most_of_all_));
            if (near != 0) ask_triangles(index, slot_of, near, a, b, c);
        });
    }

    /// Asks about the triangles `near` of a vector: each point about that with the least bound.
    /// The others whose bounds are not above the distances found wait.
    template <class SlotOf>
    HWY_INLINE void ask_triangles(std::uint32_t index, SlotOf slot_of, std::uint32_t near,
                                  const lanes::Float3& a, const lanes::Float3& b,
                                  const lanes::Float3& c) {
        const TriangleSides sides(a - centre_, b - centre_, c - centre_, extent_);
        HWY_ALIGN float bounds[kLanes][kLanes];
        FloatVec least = splat(kAnyDistance2);
        UintVec nearest = splat(0u);
        for (std::uint32_t bits = near; bits != 0; bits &= bits - 1) {
            const auto i = static_cast<std::uint32_t>(std::countr_zero(bits));
            const FloatVec bound = sides.distance2(i, from_centre_);
            store(bound, bounds[i]);
            const Mask is_less = bound < least;
            least = select(is_less, bound, least);
            nearest = select(uint_mask(is_less), splat(i), nearest);
        }
        const Mask is_open = least <= most_d2_;
        if (none(is_open)) return;
        const Leaf& leaf = bvh_.leaves[index];
        HWY_ALIGN std::uint32_t prim_ids[kLanes];
        for (std::uint32_t i = 0; i < kLanes; ++i) prim_ids[i] = leaf.prim_id[slot_of(i)];
        const auto lookup = hn::IndicesFromVec(kFloats, nearest);
        const auto of_nearest = [&](const lanes::Float3& v) HWY_ATTR {
            return lanes::Float3(hn::TableLookupLanes(v.x, lookup),
                                 hn::TableLookupLanes(v.y, lookup),
                                 hn::TableLookupLanes(v.z, lookup));
        };
        const FloatVec d2 = distances2(points_.p, of_nearest(a), of_nearest(b), of_nearest(c));
        const UintVec prim_id = as_uint(hn::TableLookupLanes(as_float(load(prim_ids)), lookup));
        const Mask is_closer =
            is_open & ((d2 < d2_) | ((d2 == d2_) & float_mask(prim_id < prim_id_)));
        if (!none(is_closer)) {
            set_closest(select(is_closer, d2, d2_),
                        select(uint_mask(is_closer), prim_id, prim_id_));
            near_leaf_ = index;
        }
        add_near(is_open & (d2 <= most_d2_), d2, index, nearest, slot_of);
        for (std::uint32_t bits = near; bits != 0; bits &= bits - 1) {
            const auto i = static_cast<std::uint32_t>(std::countr_zero(bits));
            const FloatVec bound = load(bounds[i]);
            Mask is_left = (bound <= most_d2_) & !float_mask(nearest == splat(i));
            if (none(is_left)) continue;
            is_left = is_left & sides.may_be_within(i, from_centre_, most_d2_);
            if (none(is_left)) continue;
            if (pairs_.count > PointPairs::kMost - kLanes) ask_pairs();
            const std::size_t n = pairs_.count;
            const UintVec place = hn::Iota(kUints, 0u) + splat(slot_of(i) * kMaxLanes);
            hn::CompressStore(bound, is_left, kFloats, pairs_.bound + n);
            hn::CompressStore(place, uint_mask(is_left), kUints, pairs_.lane_and_slot + n);
            store_unaligned(splat(index), pairs_.leaf + n);
            pairs_.count += simd::HWY_NAMESPACE::count(is_left);
        }
    }

    /// Adds triangles of a leaf to the lists of the points in `is_near`.
    template <class SlotOf>
    HWY_INLINE void add_near(Mask is_near, FloatVec d2, std::uint32_t leaf, UintVec triangle,
                             SlotOf slot_of) {
        if (none(is_near)) return;
        HWY_ALIGN float distances2[kLanes];
        HWY_ALIGN std::uint32_t triangles[kLanes];
        store(d2, distances2);
        store(triangle, triangles);
        const StoredClosest closest(*this);
        for (std::uint32_t bits = bits_of(is_near); bits != 0; bits &= bits - 1) {
            const auto i = static_cast<std::uint32_t>(std::countr_zero(bits));
            near_[i].add(distances2[i], leaf, slot_of(triangles[i]), closest.most_d2[i]);
        }
    }

    HWY_NOINLINE static FloatVec distances2(const lanes::Float3& p, const lanes::Float3& a,
                                            const lanes::Float3& b, const lanes::Float3& c) {
        return lanes::triangle_distance2(p, a, b, c);
    }

    HWY_NOINLINE void ask_pairs() {
        AskedPairs asked;
        for (std::size_t first = 0; first < pairs_.count; first += kLanes) {
            const UintVec lane = load_unaligned(pairs_.lane_and_slot + first) & splat(kLanes - 1);
            const FloatVec most = hn::TableLookupLanes(most_d2_, hn::IndicesFromVec(kFloats, lane));
            std::uint32_t open = bits_of(load_unaligned(pairs_.bound + first) <= most);
            if (pairs_.count - first < kLanes) open &= (1u << (pairs_.count - first)) - 1;
            for (; open != 0; open &= open - 1) {
                add_pair(first + static_cast<std::size_t>(std::countr_zero(open)), asked);
                if (asked.count == kLanes) ask(asked);
            }
        }
        if (asked.count > 0) ask(asked);
        pairs_.count = 0;
    }

    HWY_INLINE void add_pair(std::size_t pair, AskedPairs& asked) const {
        const std::uint32_t lane = pairs_.lane_and_slot[pair] % kMaxLanes;
        const std::uint32_t slot = pairs_.lane_and_slot[pair] / kMaxLanes;
        const Leaf& leaf = bvh_.leaves[pairs_.leaf[pair]];
        for (int corner = 0; corner < 3; ++corner)
            asked.set(corner, leaf_position(leaf, slot, static_cast<uint>(corner)));
        asked.set(AskedPairs::kPoint, asked_[lane]);
        asked.lane[asked.count] = lane;
        asked.slot[asked.count] = slot;
        asked.leaf[asked.count] = pairs_.leaf[pair];
        ++asked.count;
    }

    HWY_INLINE void ask(AskedPairs& asked) {
        HWY_ALIGN float d2[kLanes];
        store(distances2(asked.get(AskedPairs::kPoint), asked.get(0), asked.get(1), asked.get(2)),
              d2);
        StoredClosest closest(*this);
        for (std::uint32_t i = 0; i < asked.count; ++i) {
            const std::uint32_t lane = asked.lane[i];
            if (d2[i] > closest.most_d2[lane]) continue;
            near_[lane].add(d2[i], asked.leaf[i], asked.slot[i], closest.most_d2[lane]);
            const std::uint32_t prim_id = bvh_.leaves[asked.leaf[i]].prim_id[asked.slot[i]];
            if (!is_closer(d2[i], prim_id, closest.d2[lane], closest.prim_id[lane])) continue;
            closest.d2[lane] = d2[i];
            closest.prim_id[lane] = prim_id;
            near_leaf_ = asked.leaf[i];
        }
        set_closest(load(closest.d2), load(closest.prim_id));
        asked.count = 0;
    }

    const Bvh& bvh_;
    std::span<const vec3> asked_;
    std::uint32_t& near_leaf_;
    PointLanes points_;
    /// The points relative to a place among them, and their largest coordinate.
    lanes::Float3 centre_;
    lanes::Float3 from_centre_;
    FloatVec extent_;
    Mask is_used_;
    FloatVec margin_;
    /// The closest triangles, the squared distances of their rivals, and the largest of these.
    FloatVec d2_;
    UintVec prim_id_;
    FloatVec most_d2_;
    FloatVec most_of_all_;
    NearTriangles near_[kLanes];
    PointPairs pairs_;
};

#endif  // HWY_TARGET

}  // namespace HWY_NAMESPACE
}  // namespace mray::cpu
HWY_AFTER_NAMESPACE();
