#include "cpu/scene_space/to_scene.h"

#include <algorithm>
#include <cassert>
#include <cmath>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "cpu/scene_space/to_scene.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "cpu/simd/lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace mray::cpu::HWY_NAMESPACE {

/// The largest exponent of a factor: the power of two and its inverse are normal floats.
inline constexpr int kMostExponent = 126;

HWY_INLINE std::array<float, 3> centre_of(const SceneSpace& space) {
    return {static_cast<float>(space.centre(0)), static_cast<float>(space.centre(1)),
            static_cast<float>(space.centre(2))};
}

#if HWY_TARGET != HWY_SCALAR

/// Makes kLanes / 2 rays. A vector holds the two halves of some rays side by side: lane 2 i has
/// (org, tnear) of ray i, lane 2 i + 1 its (dir, tfar). Returns the lanes 2 i + 1 of rays that are
/// set. All operations are those of to_scene() on doubles, rounded to floats, and give its bits
/// (docs/design/arithmetic.md, "Into scene space in floats").
HWY_INLINE std::uint32_t make_rays(const StoredRay* from, const float* centre, int exponent,
                                   Ray* rays, std::int32_t* t_exponents) {
    const Mask is_dir = mask_of(0xAAAAAAAAu & kLaneBits);
    FloatVec v[3], end;
    hn::LoadInterleaved4(kFloats, from->org, v[0], v[1], v[2], end);
    const FloatVec largest = max3(abs(v[0]), abs(v[1]), abs(v[2]));
    const FloatVec sum = abs(v[0]) + abs(v[1]) + abs(v[2]);
    // A NaN compares as false.
    const Mask good_dir = (largest >= splat(0x1p-126f)) & (sum <= splat(0x1p126f));
    const IntVec bits = as_int(hn::ShiftRight<23>(as_uint(largest)));
    const IntVec own_exponent = hn::DupOdd(bits) + splat(exponent - 127);
    // Negative ones wrap to large numbers.
    const UintVec above_least = as_uint(own_exponent + splat(kMostExponent));
    const Mask good_exponent = float_mask(!(above_least > splat(2u * kMostExponent)));

    lanes::Float3 dir = lanes::canonical_direction(lanes::Float3(v));
    const FloatVec scale = as_float(as_uint(splat((exponent + 127) << 23)));
    FloatVec org[3];
    Mask good_org = mask_of(kLaneBits);
    for (int axis = 0; axis < 3; ++axis) {
        const FloatVec scaled = (v[axis] - splat(centre[axis])) * scale;
        // A ray whose origin is far away is hard.
        good_org = good_org & (abs(scaled) < splat(kFarOrigin));
        org[axis] = lanes::snap_coordinate(scaled);
    }

    const FloatVec t_scale = as_float(hn::ShiftLeft<23>(as_uint(own_exponent + splat(127))));
    const FloatVec tnear = hn::DupEven(end);
    const FloatVec tfar = hn::DupOdd(end);
    const Mask good_interval = (tnear <= tfar) & (tfar >= zero());
    FloatVec t = min(max(end, zero()) * t_scale, splat(kInfiniteT));
    const Mask long_enough = t >= splat(0x1p-100f);
    t = zero_unless(long_enough, t);

    hn::StoreInterleaved4(select(is_dir, dir.x, org[0]), select(is_dir, dir.y, org[1]),
                          select(is_dir, dir.z, org[2]), t, kFloats, &rays->org.x);
    hn::StoreU(hn::Neg(own_exponent), kInts, t_exponents);
    const std::uint32_t good_halves =
        bits_of((is_dir & good_dir & long_enough) | and_not(is_dir, good_org)) &
        bits_of(good_interval & good_exponent);
    return good_halves & good_halves << 1 & 0xAAAAAAAAu;
}

#endif

void make_rays_in_lanes(const SceneSpace& space, std::span<const StoredRay> rays, SceneRays& out) {
    out.hard_count = 0;
    std::size_t i = 0;
#if HWY_TARGET != HWY_SCALAR
    constexpr std::size_t kRays = kLanes / 2;
    const std::array<float, 3> centre = centre_of(space);
    const int exponent = space.exponent();
    const bool usable = std::abs(exponent) <= kMostExponent;
    for (; usable && i + kRays <= rays.size(); i += kRays) {
        const std::uint32_t good =
            make_rays(&rays[i], centre.data(), exponent, out.rays + i, out.t_exponents + 2 * i);
        constexpr std::uint32_t kAll = 0xAAAAAAAAu & kLaneBits;
        for (const std::uint32_t bad : BitsOf(kAll & ~good))
            out.hard[out.hard_count++] = static_cast<std::uint16_t>(i + bad / 2);
    }
#else
    (void)space;
#endif
    for (; i < rays.size(); ++i) out.hard[out.hard_count++] = static_cast<std::uint16_t>(i);
}

/// Makes `count` positions, at least kLanes; the coordinates are one array of floats. All
/// operations are those of SceneSpace::to_scene() on doubles, rounded to floats, and give its bits
/// for positions that are not left out.
HWY_INLINE MadePositions make_run(const SceneSpace& space, const float* world, std::size_t count,
                                  float* scene) {
    const FloatVec scale = as_float(as_uint(splat((space.exponent() + 127) << 23)));
    const FloatVec inverse = as_float(as_uint(splat((127 - space.exponent()) << 23)));
    const std::array<float, 3> centre = centre_of(space);
    // Three vectors hold kLanes positions. Lane l of vector k belongs to axis (k kLanes + l) % 3.
    FloatVec centres[3];
    for (std::uint32_t k = 0; k < 3; ++k) {
        alignas(64) float lanes[kLanes];
        for (std::uint32_t l = 0; l < kLanes; ++l) lanes[l] = centre[(k * kLanes + l) % 3];
        centres[k] = load(lanes);
    }
    Mask finite = mask_of(kLaneBits);
    Mask inside = finite;
    Mask invertible = finite;
    const FloatVec most = splat(space.limit());
    const FloatVec extent = splat(kSceneExtent);
    for (std::size_t i = 0; i < count; i += kLanes) {
        // The last ones may be made twice.
        const std::size_t first = 3 * std::min(i, count - kLanes);
        for (std::uint32_t k = 0; k < 3; ++k) {
            const FloatVec v = load_unaligned(world + first + k * kLanes);
            const FloatVec made = lanes::snap_coordinate((v - centres[k]) * scale);
            finite = finite & (abs(v) <= most);
            inside = inside & (abs(made) <= extent);
            invertible = invertible & (made * inverse + centres[k] == v);
            store_unaligned(made, scene + first + k * kLanes);
        }
    }
    return {!all(inside), !all(finite), all(invertible)};
}

MadePositions make_positions_in_lanes(const SceneSpace& space, std::span<const vec3> world,
                                      std::span<vec3> scene) {
    static_assert(sizeof(vec3) == 3 * sizeof(float));
    if (world.size() >= kLanes && std::abs(space.exponent()) <= kMostExponent) {
        const MadePositions made = make_run(space, &world[0].x, world.size(), &scene[0].x);
        if (!made.any_left_out) return made;
    }
    MadePositions result;
    for (std::size_t i = 0; i < world.size(); ++i) {
        const vec3 made = space.to_scene(world[i]);
        const bool is_inside = std::abs(made.x) <= kSceneExtent &&
                               std::abs(made.y) <= kSceneExtent && std::abs(made.z) <= kSceneExtent;
        const bool is_kept = space.keeps(world[i]);
        result.extend({is_kept && !is_inside, !is_kept, space.to_world(made) == world[i]});
        scene[i] = made;
    }
    return result;
}

}  // namespace mray::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE

#include "common/simd/simd_dispatch-inl.h"

namespace mray::cpu {
HWY_EXPORT(make_rays_in_lanes);
HWY_EXPORT(make_positions_in_lanes);

void make_scene_rays(const SceneSpace& space, const SimdTarget& target,
                     std::span<const StoredRay> rays, SceneRays& out) {
    assert(rays.size() <= SceneRays::kMost);
    SIMD_FUNCTION(make_rays_in_lanes, target)(space, rays, out);
}

MadePositions make_positions(const SceneSpace& space, const SimdTarget& target,
                             std::span<const vec3> world, std::span<vec3> scene) {
    assert(world.size() == scene.size());
    return SIMD_FUNCTION(make_positions_in_lanes, target)(space, world, scene);
}

}  // namespace mray::cpu

#endif  // HWY_ONCE
