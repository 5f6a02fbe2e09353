// A ray, and rays of one octant, against the 16 boxes of a node. Every box with a hit is met, with
// a least depth not beyond last_depth of that hit (docs/design/arithmetic.md, "Rays without
// packets").
#if defined(MORPHRAY_CPU_SINGLE_RAY_NODE_LANES_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef MORPHRAY_CPU_SINGLE_RAY_NODE_LANES_INL_H
#undef MORPHRAY_CPU_SINGLE_RAY_NODE_LANES_INL_H
#else
#define MORPHRAY_CPU_SINGLE_RAY_NODE_LANES_INL_H
#endif

#include "common/bvh/bvh.h"
#include "cpu/single_ray/ray_stream-inl.h"

HWY_BEFORE_NAMESPACE();
namespace mray::cpu::HWY_NAMESPACE {

/// Where a ray enters a node's boxes from `slot` on, on an axis.
HWY_INLINE FloatVec enter_on_axis(const auto& stream, std::size_t ray, const Node& node,
                                  std::size_t slot, std::uint32_t axis) {
    return mul_sub(planes_of(node, stream.near_offset[axis][ray], slot),
                   splat(stream.rdir[axis][ray]), splat(stream.k_near[axis][ray]));
}

/// Where a ray enters a vector of boxes on each axis, and where it enters and leaves them; it meets
/// a box if enter <= leave.
struct BoxTimes {
    FloatVec enter_axis[3], enter, leave;
};

/// The times for a node's boxes from `slot` on, up to last_entry() of `last`.
HWY_INLINE BoxTimes box_times(const auto& stream, std::size_t ray, float last, const Node& node,
                              std::size_t slot) {
    const FloatVec end = splat(last_entry(stream.depth_margin[ray], last));
    FloatVec enter[3], leave[3];
    for (std::uint32_t axis = 0; axis < 3; ++axis) {
        enter[axis] = enter_on_axis(stream, ray, node, slot, axis);
        const FloatVec far = planes_of(node, other_side(stream.near_offset[axis][ray]), slot);
        leave[axis] =
            mul_sub(far, splat(stream.rdir_far[axis][ray]), splat(stream.k_far[axis][ray]));
    }
    return {{enter[0], enter[1], enter[2]},
            max(max(enter[0], enter[1]), max(enter[2], zero())),
            min(min(leave[0], leave[1]), min(leave[2], end))};
}

/// The slots whose boxes the ray meets up to tfar, as bits.
HWY_INLINE std::uint32_t met_slots(const auto& stream, std::size_t ray, const Node& node) {
    return bits_of_sixteen([&](std::size_t slot) HWY_ATTR {
        const BoxTimes times = box_times(stream, ray, stream.last_depth[ray], node, slot);
        return times.enter <= times.leave;
    });
}

/// The slots whose boxes the ray meets with a least depth of `last` or less, as bits, and the least
/// depths of all boxes. kAxis is the ray's main axis, or kAnyAxis.
template <int kAxis = kAnyAxis>
HWY_INLINE std::uint32_t near_slots(const auto& stream, std::size_t ray, float last,
                                    const Node& node, FloatVec* HWY_RESTRICT t_least) {
    const FloatVec margin = splat(stream.depth_margin[ray]);
    std::uint32_t slots = 0;
    for (std::size_t v = 0; v < kVectors; ++v) {
        const BoxTimes times = box_times(stream, ray, last, node, v * kLanes);
        FloatVec along;
        if constexpr (kAxis == kAnyAxis) {
            along = enter_on_axis(stream, ray, node, v * kLanes, stream.axis[ray]);
        } else {
            along = times.enter_axis[kAxis];
        }
        const Mask met = (times.enter <= times.leave) & (along <= splat(last));
        t_least[v] = lanes::least_depth(times.enter, along, margin);
        slots |= bits_of(met) << (v * kLanes);
    }
    return slots;
}

// Rays of one octant (the same sign of rdir on each axis): first all of them at once, with the
// boxes for lanes, then each ray, as one ray is tested, with the rays for lanes.

/// For each axis the ends of org +- D and of rdir over the rays, and the offset of the near planes.
struct RayBundle {
    float org_near[3], org_far[3], rdir_least[3], rdir_most[3];
    std::uint32_t near_offset[3];
    // Whether it is the main axis of a ray.
    bool is_main[3];
    float depth_margin;
};

struct LaneRange {
    FloatVec least, most;

    HWY_INLINE explicit LaneRange(FloatVec v) : least(v), most(v) {}
    HWY_INLINE void add(FloatVec v) {
        least = min(least, v);
        most = max(most, v);
    }
    HWY_INLINE float lower() const { return hn::GetLane(hn::MinOfLanes(kFloats, least)); }
    HWY_INLINE float upper() const { return hn::GetLane(hn::MaxOfLanes(kFloats, most)); }
};

/// The largest of the first `count` values, at least one; those up to the end of a vector count.
HWY_INLINE float largest_of(const float* values, std::size_t count) {
    FloatVec most = load(values);
    for (std::size_t i = kLanes; i < count; i += kLanes) most = max(most, load(values + i));
    return hn::GetLane(hn::MaxOfLanes(kFloats, most));
}

HWY_INLINE void bundle_axis(const RayStream& stream, std::size_t count, std::uint32_t axis,
                            RayBundle& bundle) {
    const auto dilated = [&](std::size_t first, float sign) HWY_ATTR {
        const FloatVec org = load(stream.org[axis] + first);
        const FloatVec d = kDilationOfOrigin * abs(org) + load(stream.least_dilation + first);
        return sign > 0 ? org + d : org - d;
    };
    LaneRange below(dilated(0, 1));
    LaneRange above(dilated(0, -1));
    LaneRange rdir(load(stream.rdir[axis]));
    UintMask is_main = load(stream.axis) == splat(axis);
    for (std::size_t first = kLanes; first < count; first += kLanes) {
        below.add(dilated(first, 1));
        above.add(dilated(first, -1));
        rdir.add(load(stream.rdir[axis] + first));
        is_main = is_main | (load(stream.axis + first) == splat(axis));
    }
    const bool negative = stream.rdir[axis][0] < 0;
    bundle.org_near[axis] = negative ? above.lower() : below.upper();
    bundle.org_far[axis] = negative ? below.upper() : above.lower();
    bundle.rdir_least[axis] = rdir.lower();
    bundle.rdir_most[axis] = rdir.upper();
    bundle.near_offset[axis] = stream.near_offset[axis][0];
    bundle.is_main[axis] = !none(is_main);
}

HWY_INLINE RayBundle bundle_of(const RayStream& stream, std::size_t count) {
    RayBundle bundle;
    for (std::uint32_t axis = 0; axis < 3; ++axis) bundle_axis(stream, count, axis, bundle);
    bundle.depth_margin = largest_of(stream.depth_margin, count);
    return bundle;
}

/// The slots whose boxes a ray of the bundle may meet with a least depth of `last` or less, as
/// bits, and a lower bound of the least depths for its rays.
HWY_INLINE std::uint32_t near_slots(const RayBundle& bundle, float last, const Node& node,
                                    FloatVec* HWY_RESTRICT t_least) {
    std::uint32_t slots = 0;
    for (std::size_t v = 0; v < kVectors; ++v) {
        FloatVec enter = zero();
        FloatVec along = splat(kInfiniteT);
        FloatVec leave = splat(kInfiniteT);
        for (int axis = 0; axis < 3; ++axis) {
            const std::uint32_t offset = bundle.near_offset[axis];
            const FloatVec near = planes_of(node, offset, v * kLanes) - bundle.org_near[axis];
            const FloatVec far =
                planes_of(node, other_side(offset), v * kLanes) - bundle.org_far[axis];
            const FloatVec least = splat(bundle.rdir_least[axis]);
            const FloatVec most = splat(bundle.rdir_most[axis]);
            // The earliest and the latest time of a ray.
            const FloatVec entry = min(near * least, near * most);
            enter = max(enter, entry);
            if (bundle.is_main[axis]) along = min(along, entry);
            leave = min(leave, max(far * least, far * most));
        }
        t_least[v] = lanes::least_depth(enter, along, splat(bundle.depth_margin));
        const Mask met = (enter <= leave * kSlabRounding) & (t_least[v] <= splat(last));
        slots |= bits_of(met) << (v * kLanes);
    }
    return slots;
}

/// Sets met[slot], for these slots, to the rays among `rays` (bits) that enter the box in the slot
/// no later than at last_entry() of last[ray].
HWY_INLINE void rays_meeting(const RayStream& stream, const RayBundle& bundle, const float* last,
                             std::uint64_t rays, const Node& node, std::uint32_t slots,
                             std::uint64_t* HWY_RESTRICT met) {
    const float *near[3], *far[3];
    for (int axis = 0; axis < 3; ++axis) {
        near[axis] = planes_at(node, bundle.near_offset[axis]);
        far[axis] = planes_at(node, other_side(bundle.near_offset[axis]));
    }
    for (const std::uint32_t slot : BitsOf(slots)) met[slot] = 0;
    for (std::size_t first = 0; first < kStreamRays; first += kLanes) {
        const auto active = static_cast<std::uint32_t>(rays >> first & kLaneBits);
        if (active == 0) continue;
        FloatVec rdir[3], rdir_far[3], k_near[3], k_far[3];
        for (int axis = 0; axis < 3; ++axis) {
            rdir[axis] = load(stream.rdir[axis] + first);
            rdir_far[axis] = load(stream.rdir_far[axis] + first);
            k_near[axis] = load(stream.k_near[axis] + first);
            k_far[axis] = load(stream.k_far[axis] + first);
        }
        const FloatVec end =
            lanes::last_entry(load(stream.depth_margin + first), load(last + first));
        for (const std::uint32_t slot : BitsOf(slots)) {
            FloatVec enter = zero();
            FloatVec leave = end;
            for (int axis = 0; axis < 3; ++axis) {
                enter = max(enter, mul_sub(splat(near[axis][slot]), rdir[axis], k_near[axis]));
                leave = min(leave, mul_sub(splat(far[axis][slot]), rdir_far[axis], k_far[axis]));
            }
            met[slot] |= std::uint64_t{bits_of(enter <= leave) & active} << first;
        }
    }
}

}  // namespace mray::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per target
