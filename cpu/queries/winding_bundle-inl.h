// Windings around points above each other, one a lane: they share nodes and leaves.
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>

#include "common/bvh/bvh.h"
#include "common/scene_queries.h"
#include "cpu/queries/points-inl.h"
#include "cpu/single_ray/node_lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace mray::cpu {
namespace HWY_NAMESPACE {
using namespace simd::HWY_NAMESPACE;

#if HWY_TARGET != HWY_SCALAR

class WindingBundle {
public:
    /// `points` are those of clipped_point().
    HWY_INLINE explicit WindingBundle(std::span<const vec3> points)
        : points_(points), used_(mask_of((1u << points.size()) - 1)) {}

    /// Calls uncertain(i, prim_id) where floats cannot decide. False: gave up after `most_leaves`.
    template <class Uncertain>
    HWY_INLINE bool search(const Bvh& bvh, std::size_t most_leaves, Uncertain uncertain) {
        const auto met = [&](const Node& node) HWY_ATTR {
            return slots_of(node,
                            [&](const BoxLanes& boxes) HWY_ATTR { return may_cross_in(boxes); });
        };
        std::size_t leaves = 0;
        return for_each_leaf(bvh, met, [&](const Leaf& leaf) HWY_ATTR {
            if (++leaves > most_leaves) return false;
            wind_around_leaf(bvh, leaf, uncertain);
            return true;
        });
    }

    HWY_INLINE void store_windings(std::span<FloatWinding> windings) const {
        HWY_ALIGN std::int32_t winding[kLanes];
        HWY_ALIGN std::int32_t crossings[kLanes];
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
        return (boxes.lower.x - points_.upper.x <= most) &
               (boxes.upper.x - points_.lower.x >= least) &
               (boxes.lower.y - points_.upper.y <= most) &
               (boxes.upper.y - points_.lower.y >= least) &
               (boxes.upper.z - points_.lower.z >= least);
    }

    template <class Uncertain>
    HWY_INLINE void wind_around_leaf(const Bvh& bvh, const Leaf& leaf, Uncertain& uncertain) {
        for_each_triangle(leaf, [&](auto slot_of, Mask used, const lanes::Float3& a,
                                    const lanes::Float3& b, const lanes::Float3& c) HWY_ATTR {
            const Mask met = used & may_cross_in(boxes_of(a, b, c));
            for (std::uint32_t bits = bits_of(met); bits != 0; bits &= bits - 1) {
                const auto lane = static_cast<std::uint32_t>(std::countr_zero(bits));
                wind_around(bvh, leaf, slot_of(lane), uncertain);
            }
        });
    }

    template <class Uncertain>
    HWY_INLINE void wind_around(const Bvh& bvh, const Leaf& leaf, std::uint32_t slot,
                                Uncertain& uncertain) {
        const lanes::FloatCrossing crossing =
            lanes::float_crossing(points_.p, lanes::Float3(leaf_position(leaf, slot, 0)),
                                  lanes::Float3(leaf_position(leaf, slot, 1)),
                                  lanes::Float3(leaf_position(leaf, slot, 2)));
        const std::uint32_t prim_id = leaf.prim_id[slot];
        const auto repeats = repeats_of(bvh, prim_id);
        const IntVec times = splat(static_cast<std::int32_t>(1 + repeats.size()));
        const auto times_where = [&](Mask m) HWY_ATTR {
            return hn::IfThenElseZero(hn::RebindMask(kInts, m), times);
        };
        const IntVec up = times_where(crossing.is_up);
        const IntVec down = times_where(crossing.is_down);
        winding_ = winding_ + up - down;
        crossings_ = crossings_ + up + down;
        for (std::uint32_t bits = bits_of(crossing.is_uncertain & used_); bits != 0;
             bits &= bits - 1) {
            const auto point = static_cast<std::uint32_t>(std::countr_zero(bits));
            uncertain(point, prim_id);
            for (const RepeatedTriangle& repeat : repeats) uncertain(point, repeat.prim_id);
        }
    }

    PointLanes points_;
    Mask used_;
    IntVec winding_ = hn::Zero(kInts);
    IntVec crossings_ = hn::Zero(kInts);
};

#endif  // HWY_TARGET

}  // namespace HWY_NAMESPACE
}  // namespace mray::cpu
HWY_AFTER_NAMESPACE();
