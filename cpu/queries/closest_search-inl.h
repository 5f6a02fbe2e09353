// The closest triangle to a point by the rule, and its rivals: those that may be closer exactly.
// Rivals are found on the way, since they are in the same leaves.
#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <limits>

#include "common/bvh/bvh.h"
#include "common/scene_queries.h"
#include "cpu/queries/points-inl.h"
#include "cpu/queries/tree_queries.h"
#include "cpu/simd/lanes-inl.h"
#include "cpu/simd/rounding_bounds.h"

HWY_BEFORE_NAMESPACE();
namespace mray::cpu {
namespace HWY_NAMESPACE {
using namespace simd::HWY_NAMESPACE;

// A lower bound of the distance of a triangle from a point that is much cheaper than the rule.
//
// It takes one direction w. The offset r of each place of the triangle is at least r.w / |w| long,
// and r.w is least at a vertex. With w the offset of the nearest vertex, the bound is the distance
// itself where that vertex is the closest point.
//
// Rounding, that of the rule as well, is covered by the constants (lab/proofs/closest.g). No answer
// depends on the bound, so it may be fused, and differ by target.

HWY_INLINE FloatVec fused_dot(const lanes::Float3& a, const lanes::Float3& b) {
    return mul_add(a.x, b.x, mul_add(a.y, b.y, a.z * b.z));
}

/// The square of how far the bound by the nearest vertex is off, by the largest coordinate.
HWY_INLINE FloatVec nearest_vertex_error2(FloatVec size) {
    return mul_add(size * size, splat(kNearestVertexErrorSquare),
                   splat(kLeastNearestVertexErrorSquare));
}

/// Where the rule may give d2 or less for a point and the triangle a, b, c, relative to it.
HWY_INLINE Mask may_be_within(const lanes::Float3& a, const lanes::Float3& b,
                              const lanes::Float3& c, FloatVec error2, FloatVec d2) {
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

/// The triangles near a point, among which the closest one is.
class NearTriangles {
public:
    /// Adds the triangle in a slot of a leaf; `least` is a lower bound of its distance. Triangles
    /// whose bound is above `most` may be dropped.
    HWY_INLINE void add(float least, std::uint32_t leaf, std::uint32_t slot, float most) {
        if (count_ == kMost) keep_within(most);
        if (count_ < kMost) {
            near_[count_++] = {least, leaf * kWidth + slot};
        } else {
            least_lost_ = std::min(least_lost_, least);
        }
    }

    /// Appends the triangles whose bound is at most `most`, or kNoPrim if they were too many.
    HWY_INLINE void append_to(Rivals& rivals, const Bvh& bvh, float most) {
        keep_within(most);
        if (least_lost_ <= most) {
            rivals.triangles.push_back({kNoPrim, {}});
            return;
        }
        for (std::size_t i = 0; i < count_; ++i) {
            const std::uint32_t place = near_[i].place;
            rivals.triangles.push_back(triangle_of(bvh.leaves[place / kWidth], place % kWidth));
        }
    }

private:
    static constexpr std::size_t kMost = 64;
    struct Near {
        float least;
        std::uint32_t place;
    };

    HWY_INLINE void keep_within(float most) {
        std::size_t kept = 0;
        for (std::size_t i = 0; i < count_; ++i)
            if (near_[i].least <= most) near_[kept++] = near_[i];
        count_ = kept;
    }

    Near near_[kMost];
    std::size_t count_ = 0;
    float least_lost_ = std::numeric_limits<float>::infinity();
};

/// Looks for the triangle that is the closest to a point by the rule, and for all that may be the
/// exactly closest one.
class ClosestSearch {
public:
    /// Those farther than `closest` do not count.
    HWY_INLINE ClosestSearch(vec3 point, ClosestTriangle closest) : p_(point), closest_(closest) {
        const FloatVec farthest = lanes::largest_component(p_);
        point_error_ = splat(kPointRounding) * (farthest + splat(1.0f));
        // No corner is farther on an axis.
        set_most(most_of(hn::Sqrt(splat(closest.d2)), farthest + splat(kSceneExtent)));
    }

    /// Visits the leaf `near_leaf` first. It is the leaf of the answer for the point before, and
    /// becomes that of the answer for this point.
    HWY_INLINE void search(const Bvh& bvh, std::uint32_t& near_leaf) {
        const std::uint32_t first_leaf = near_leaf;
        if (first_leaf < bvh.leaves.size()) search_leaf(bvh, first_leaf);
        const auto near = [&](const Node& node, float* HWY_RESTRICT d2) HWY_ATTR {
            const auto distance2 = [&](const BoxLanes& boxes) HWY_ATTR {
                return lanes::box_distance2(p_, boxes.lower, boxes.upper);
            };
            return slots_within(node, splat(most_d2_), distance2, d2);
        };
        for_each_near_leaf(bvh, most_d2_, near, [&](std::uint32_t leaf) HWY_ATTR {
            if (leaf == first_leaf) return;
            const std::uint32_t before = closest_.prim_id;
            search_leaf(bvh, leaf);
            if (closest_.prim_id != before) near_leaf = leaf;
        });
    }

    const ClosestTriangle& closest() const { return closest_; }
    HWY_INLINE void append_to(Rivals& rivals, const Bvh& bvh) {
        if (closest_.prim_id != kNoPrim) near_.append_to(rivals, bvh, most_);
        rivals.ends.push_back(static_cast<std::uint32_t>(rivals.triangles.size()));
    }

private:
    /// An upper bound of the exact distances of triangles, by those of the rule and their largest
    /// coordinates relative to the point.
    HWY_INLINE FloatVec most_of(FloatVec d, FloatVec size) const {
        return d + splat(kRuleDefect) * size + point_error_;
    }

    HWY_INLINE void set_most(FloatVec most) {
        most_ = hn::GetLane(most);
        most_d2_ = hn::GetLane(most * most * splat(kRivalRounding));
    }

    HWY_INLINE void search_leaf(const Bvh& bvh, std::uint32_t index) {
        const Leaf& leaf = bvh.leaves[index];
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
            near = near & may_be_within(to_a, to_b, to_c, nearest_vertex_error2(size), most_d2);
            if (none(near)) return;
            const FloatVec d2 = lanes::triangle_distance2(p_, a, b, c);
            const FloatVec d = hn::Sqrt(d2);
            const FloatVec least = d - splat(kRuleExcess) * size;
            near = near & (least <= splat(most_));
            if (none(near)) return;
            const auto for_each_of = [&](Mask lanes, auto use) HWY_ATTR {
                for (std::uint32_t bits = bits_of(lanes); bits != 0; bits &= bits - 1)
                    use(static_cast<std::uint32_t>(std::countr_zero(bits)));
            };
            HWY_ALIGN float values[kLanes];
            const Mask closer = near & (d2 <= splat(closest_.d2));
            if (!none(closer)) {
                store(d2, values);
                for_each_of(closer, [&](std::uint32_t i) {
                    const std::uint32_t prim_id = leaf.prim_id[slot_of(i)];
                    if (is_closer(values[i], prim_id, closest_.d2, closest_.prim_id))
                        closest_ = {values[i], prim_id};
                });
                const FloatVec most = splat(most_);
                set_most(hn::MinOfLanes(kFloats, select(near, min(most_of(d, size), most), most)));
            }
            store(least, values);
            for_each_of(near & (least <= splat(most_)),
                        [&](std::uint32_t i) { near_.add(values[i], index, slot_of(i), most_); });
        });
    }

    lanes::Float3 p_;
    FloatVec point_error_;
    ClosestTriangle closest_;
    /// The exactly closest triangle is no farther than this.
    float most_;
    /// Its square, rounded up, for comparisons with squared distances.
    float most_d2_;
    NearTriangles near_;
};

}  // namespace HWY_NAMESPACE
}  // namespace mray::cpu
HWY_AFTER_NAMESPACE();
