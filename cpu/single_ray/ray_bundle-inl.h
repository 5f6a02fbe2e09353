// Rays of one octant (the same sign of rdir on each axis) against the boxes of a node: first all of
// them at once, with the boxes for lanes, then each ray against the boxes that remain, with the
// rays for lanes.
//
// A box that a ray hits something in is never lost, and entered no later than last_entry of that
// hit:
// 1. A ray alone meets a plane p at fl(fl(p - o) * r), with o = fl(org +- D) and r its rdir: the
//    operations of hits_box, whose entry is no later than last_entry of any hit in the box
//    (docs/design/arithmetic.md, "Boxes").
// 2. Let r > 0. Over the rays, O is the largest o of lower planes, R- the least r and R+ the
//    largest. Rounding is monotone, so fl(p - O) = x <= fl(p - o), and fl(x * r) is not below both
//    fl(x * R-) and fl(x * R+), since x * r lies between x * R- and x * R+.
// 3. So the smaller of these two is an entry no later than that of step 1 for every ray of the
//    bundle, bit for bit and without another epsilon.
// 4. Exits, and r < 0, mirror steps 2 and 3, with the smallest o of upper planes.
// 5. A box of no triangles is inverted by 2^48 on all axes, far beyond all o, so that it has an
//    exit below 0.
//
// The rays that remain are tested as in cpu/single_ray/node_lanes-inl.h.
#if defined(MORPHRAY_CPU_SINGLE_RAY_RAY_BUNDLE_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef MORPHRAY_CPU_SINGLE_RAY_RAY_BUNDLE_INL_H
#undef MORPHRAY_CPU_SINGLE_RAY_RAY_BUNDLE_INL_H
#else
#define MORPHRAY_CPU_SINGLE_RAY_RAY_BUNDLE_INL_H
#endif

#include <bit>
#include <cstddef>
#include <cstdint>

#include "cpu/simd/lanes-inl.h"
#include "cpu/single_ray/node_lanes-inl.h"
#include "cpu/single_ray/ray_stream-inl.h"

HWY_BEFORE_NAMESPACE();
namespace mray::cpu {
namespace HWY_NAMESPACE {
using namespace simd::HWY_NAMESPACE;

/// For each axis the ends of org +- D and of rdir over the rays, and the offset of the near planes.
struct RayBundle {
    float org_near[3];
    float org_far[3];
    float rdir_least[3];
    float rdir_most[3];
    std::uint32_t near_offset[3];
};

/// The least and the most that has been added.
struct LaneRange {
    FloatVec least;
    FloatVec most;

    HWY_INLINE explicit LaneRange(FloatVec v) : least(v), most(v) {}
    HWY_INLINE void add(FloatVec v) {
        least = min(least, v);
        most = max(most, v);
    }
    HWY_INLINE float lower() const { return hn::GetLane(hn::MinOfLanes(kFloats, least)); }
    HWY_INLINE float upper() const { return hn::GetLane(hn::MaxOfLanes(kFloats, most)); }
};

/// The bundle of the first `count` rays, at least one.
HWY_INLINE RayBundle bundle_of(const RayStream& stream, std::size_t count) {
    RayBundle bundle;
    for (int axis = 0; axis < 3; ++axis) {
        const auto vector = [](const float(&values)[3][kStreamRays], int k, std::size_t first)
                                HWY_ATTR { return load(values[k] + first); };
        const auto dilation = [&](std::size_t first) HWY_ATTR {
            return lanes::box_dilation({vector(stream.org, 0, first), vector(stream.org, 1, first),
                                        vector(stream.org, 2, first)});
        };
        LaneRange below(vector(stream.org, axis, 0) + dilation(0));
        LaneRange above(vector(stream.org, axis, 0) - dilation(0));
        LaneRange rdir(vector(stream.rdir, axis, 0));
        for (std::size_t first = kLanes; first < count; first += kLanes) {
            below.add(vector(stream.org, axis, first) + dilation(first));
            above.add(vector(stream.org, axis, first) - dilation(first));
            rdir.add(vector(stream.rdir, axis, first));
        }
        const bool negative = stream.rdir[axis][0] < 0;
        bundle.org_near[axis] = negative ? above.lower() : below.upper();
        bundle.org_far[axis] = negative ? below.upper() : above.lower();
        bundle.rdir_least[axis] = rdir.lower();
        bundle.rdir_most[axis] = rdir.upper();
        bundle.near_offset[axis] = stream.near_offset[axis][0];
    }
    return bundle;
}

/// The slots whose boxes a ray of the bundle may enter no later than at `last`, as bits, and a
/// lower bound of where a ray enters each box.
HWY_INLINE std::uint32_t met_slots(const RayBundle& bundle, float last, const Node& node,
                                   FloatVec* HWY_RESTRICT t_enter) {
    std::uint32_t slots = 0;
    for (std::size_t v = 0; v < kVectors; ++v) {
        FloatVec enter = zero();
        FloatVec leave = splat(last);
        for (int axis = 0; axis < 3; ++axis) {
            const std::size_t near_offset = bundle.near_offset[axis];
            const FloatVec near = load_planes(node, near_offset, v) - bundle.org_near[axis];
            const FloatVec far =
                load_planes(node, near_offset ^ kPlaneBytes, v) - bundle.org_far[axis];
            const FloatVec least = splat(bundle.rdir_least[axis]);
            const FloatVec most = splat(bundle.rdir_most[axis]);
            enter = max(enter, min(near * least, near * most));
            leave = min(leave, max(far * least, far * most));
        }
        t_enter[v] = enter;
        slots |= bits_of(enter <= leave) << (v * kLanes);
    }
    return slots;
}

/// Sets met[slot], for these slots, to the rays among `rays` (bits) that enter the box in the slot
/// no later than at last[ray].
HWY_INLINE void rays_meeting(const RayStream& stream, const RayBundle& bundle, const float* last,
                             std::uint64_t rays, const Node& node, std::uint32_t slots,
                             std::uint64_t* HWY_RESTRICT met) {
    const float* near[3];
    const float* far[3];
    for (int axis = 0; axis < 3; ++axis) {
        const auto* const bytes = reinterpret_cast<const std::byte*>(&node);
        const std::uint32_t offset = bundle.near_offset[axis];
        near[axis] = reinterpret_cast<const float*>(bytes + offset);
        far[axis] = reinterpret_cast<const float*>(bytes + (offset ^ kPlaneBytes));
    }
    for (std::uint32_t left = slots; left != 0; left &= left - 1) met[std::countr_zero(left)] = 0;
    for (std::size_t first = 0; first < kStreamRays; first += kLanes) {
        const auto asked = static_cast<std::uint32_t>(rays >> first & kLaneBits);
        if (asked == 0) continue;
        FloatVec rdir[3];
        FloatVec k_near[3];
        FloatVec k_far[3];
        for (int axis = 0; axis < 3; ++axis) {
            rdir[axis] = load(stream.rdir[axis] + first);
            k_near[axis] = load(stream.k_near[axis] + first);
            k_far[axis] = load(stream.k_far[axis] + first);
        }
        const FloatVec end = load(last + first);
        for (std::uint32_t left = slots; left != 0; left &= left - 1) {
            const int slot = std::countr_zero(left);
            FloatVec enter = zero();
            FloatVec leave = end;
            for (int axis = 0; axis < 3; ++axis) {
                enter = max(enter, mul_sub(splat(near[axis][slot]), rdir[axis], k_near[axis]));
                leave = min(leave, mul_sub(splat(far[axis][slot]), rdir[axis], k_far[axis]));
            }
            met[slot] |= std::uint64_t{bits_of(enter <= leave) & asked} << first;
        }
    }
}

/// The largest of the first `count` values, at least one; those up to the end of a vector count.
HWY_INLINE float largest_of(const float* values, std::size_t count) {
    FloatVec most = load(values);
    for (std::size_t i = kLanes; i < count; i += kLanes) most = max(most, load(values + i));
    return hn::GetLane(hn::MaxOfLanes(kFloats, most));
}

}  // namespace HWY_NAMESPACE
}  // namespace mray::cpu
HWY_AFTER_NAMESPACE();

#endif  // per target
