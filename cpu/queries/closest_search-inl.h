// The closest triangle to a point by the rule, and its rivals: those that may be closer exactly.
// Rivals are found on the way, since they are in the same leaves.
#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <limits>

#include "common/bvh/bvh.h"
#include "common/scene_queries.h"
#include "cpu/queries/nearest_vertex-inl.h"
#include "cpu/queries/points-inl.h"
#include "cpu/queries/tree_queries.h"
#include "cpu/simd/rounding_bounds.h"

HWY_BEFORE_NAMESPACE();
namespace mray::cpu {
namespace HWY_NAMESPACE {
using namespace simd::HWY_NAMESPACE;

/// By how much the distances of two triangles may differ by the rule if they do not exactly.
HWY_INLINE FloatVec rival_margin(const lanes::Float3& p) {
    const FloatVec farthest = splat(1.75f) * (lanes::largest_component(p) + splat(kSceneExtent));
    return splat(2 * kRuleError) * farthest;
}

/// The largest squared distance by the rule of triangles that may be as close as one at d2.
HWY_INLINE FloatVec most_of_rivals(FloatVec d2, FloatVec margin) {
    const FloatVec most = hn::Sqrt(d2) + margin;
    return most * most * splat(kRivalRounding);
}

/// The triangles near a point, among which the closest one is.
class NearTriangles {
public:
    /// Takes the triangle in a slot of a leaf, within most_d2, above which others have become
    /// useless.
    HWY_INLINE void add(float d2, std::uint32_t leaf, std::uint32_t slot, float most_d2) {
        if (count_ == kMost) keep_within(most_d2);
        if (count_ < kMost) {
            near_[count_++] = {d2, leaf * kWidth + slot};
        } else {
            least_lost_ = std::min(least_lost_, d2);
        }
    }

    HWY_INLINE void append_to(Rivals& rivals, const Bvh& bvh, float most_d2) {
        keep_within(most_d2);
        if (least_lost_ <= most_d2) {
            rivals.triangles.push_back({kNoPrim, {}});
            return;
        }
        for (std::size_t i = 0; i < count_; ++i) {
            const std::uint32_t place = near_[i].place;
            rivals.triangles.push_back(triangle_of(bvh.leaves[place / kWidth], place % kWidth));
        }
    }

private:
    static constexpr std::size_t kMost = 12;
    struct Near {
        float d2;
        std::uint32_t place;
    };

    HWY_INLINE void keep_within(float most_d2) {
        std::size_t kept = 0;
        for (std::size_t i = 0; i < count_; ++i)
            if (near_[i].d2 <= most_d2) near_[kept++] = near_[i];
        count_ = kept;
    }

    Near near_[kMost];
    std::size_t count_ = 0;
    float least_lost_ = std::numeric_limits<float>::infinity();
};

/// Looks for the triangle that is the closest to a point.
class ClosestSearch {
public:
    /// Those farther than `closest` do not count.
    HWY_INLINE ClosestSearch(vec3 point, ClosestTriangle closest)
        : p_(point), margin_(rival_margin(p_)), closest_(closest) {
        set_most();
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
        if (closest_.prim_id != kNoPrim) near_.append_to(rivals, bvh, most_d2_);
        rivals.ends.push_back(static_cast<std::uint32_t>(rivals.triangles.size()));
    }

private:
    HWY_INLINE void set_most() {
        most_d2_ = hn::GetLane(most_of_rivals(splat(closest_.d2), margin_));
    }

    HWY_INLINE void search_leaf(const Bvh& bvh, std::uint32_t index) {
        const Leaf& leaf = bvh.leaves[index];
        for_each_triangle(leaf, [&](auto slot_of, Mask used, const lanes::Float3& a,
                                    const lanes::Float3& b, const lanes::Float3& c) HWY_ATTR {
            const FloatVec most = splat(most_d2_);
            const BoxLanes boxes = boxes_of(a, b, c);
            const FloatVec box = lanes::box_distance2(p_, boxes.lower, boxes.upper);
            Mask near = used & (box <= most);
            if (none(near)) return;
            const lanes::Float3 to_a = a - p_;
            const lanes::Float3 to_b = b - p_;
            const lanes::Float3 to_c = c - p_;
            const FloatVec size =
                max3(lanes::largest_component(to_a), lanes::largest_component(to_b),
                     lanes::largest_component(to_c));
            near = near & may_be_within(to_a, to_b, to_c, nearest_vertex_error2(size), most);
            if (none(near)) return;
            const FloatVec d2 = lanes::triangle_distance2(p_, a, b, c);
            near = near & (d2 <= most);
            if (none(near)) return;
            HWY_ALIGN float distances2[kLanes];
            store(d2, distances2);
            const auto for_each_of = [&](Mask lanes, auto use) HWY_ATTR {
                for (std::uint32_t bits = bits_of(lanes); bits != 0; bits &= bits - 1) {
                    const auto i = static_cast<std::uint32_t>(std::countr_zero(bits));
                    use(distances2[i], slot_of(i));
                }
            };
            for_each_of(near & (d2 <= splat(closest_.d2)), [&](float own2, std::uint32_t slot) {
                if (is_closer(own2, leaf.prim_id[slot], closest_.d2, closest_.prim_id))
                    closest_ = {own2, leaf.prim_id[slot]};
            });
            set_most();
            for_each_of(near & (d2 <= splat(most_d2_)), [&](float own2, std::uint32_t slot) {
                near_.add(own2, index, slot, most_d2_);
            });
        });
    }

    lanes::Float3 p_;
    FloatVec margin_;
    ClosestTriangle closest_;
    float most_d2_;
    NearTriangles near_;
};

}  // namespace HWY_NAMESPACE
}  // namespace mray::cpu
HWY_AFTER_NAMESPACE();
