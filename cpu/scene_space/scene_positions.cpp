#include "cpu/scene_space/scene_positions.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "cpu/scene_space/scene_positions.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "cpu/simd/lanes-inl.h"

#ifndef MORPHRAY_MADE_FLAG
#define MORPHRAY_MADE_FLAG
namespace mray::cpu {
/// Facts about a run of positions.
enum MadeFlag { kNotFinite = 1, kOutside = 2, kNotInvertible = 4 };
}  // namespace mray::cpu
#endif

HWY_BEFORE_NAMESPACE();
namespace mray::cpu {
namespace HWY_NAMESPACE {

/// Makes `count` positions, a multiple of kLanes; the coordinates are one array of floats. All
/// operations are those of SceneSpace::to_scene() on doubles, rounded to floats, and give its bits
/// for positions that are finite (make_rays() in scene_rays.cpp says why). Returns flags of
/// MadeFlag.
int make_positions(const float* world, std::size_t count, const float* centre, int exponent,
                   float* scene) {
    const FloatVec scale = as_float(as_uint(splat((exponent + 127) << 23)));
    const FloatVec inverse = as_float(as_uint(splat((127 - exponent) << 23)));
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
    const FloatVec most = splat(std::numeric_limits<float>::max());
    const FloatVec extent = splat(kSceneExtent);
    for (std::size_t i = 0; i < 3 * count; i += 3 * kLanes) {
        for (std::uint32_t k = 0; k < 3; ++k) {
            const FloatVec v = load_unaligned(world + i + k * kLanes);
            const FloatVec made = lanes::snap_coordinate((v - centres[k]) * scale);
            finite = finite & (abs(v) <= most);
            inside = inside & (abs(made) <= extent);
            invertible = invertible & (made * inverse + centres[k] == v);
            store_unaligned(made, scene + i + k * kLanes);
        }
    }
    return (all(finite) ? 0 : kNotFinite) | (all(inside) ? 0 : kOutside) |
           (all(invertible) ? 0 : kNotInvertible);
}

/// How many positions make_positions() makes together.
int position_step() { return static_cast<int>(kLanes); }

}  // namespace HWY_NAMESPACE
}  // namespace mray::cpu
HWY_AFTER_NAMESPACE();

#if HWY_ONCE

#include "common/simd/simd_dispatch-inl.h"

namespace mray::cpu {
namespace {

HWY_EXPORT(make_positions);
HWY_EXPORT(position_step);

bool is_outside(vec3 world, vec3 scene) {
    if (!std::isfinite(world.x) || !std::isfinite(world.y) || !std::isfinite(world.z)) return false;
    return !(std::abs(scene.x) <= kSceneExtent && std::abs(scene.y) <= kSceneExtent &&
             std::abs(scene.z) <= kSceneExtent);
}

}  // namespace

ScenePositionMaker::ScenePositionMaker(const SceneSpace& space, const SimdTarget& target)
    : space_(space),
      centre_{static_cast<float>(space.centre(0)), static_cast<float>(space.centre(1)),
              static_cast<float>(space.centre(2))},
      make_(SIMD_FUNCTION(make_positions, target)),
      step_(static_cast<std::size_t>(SIMD_FUNCTION(position_step, target)())) {}

MadePositions ScenePositionMaker::make(std::span<const vec3> world, std::span<vec3> scene) const {
    assert(world.size() == scene.size());
    // Larger powers of two are no floats.
    constexpr int kMostExponent = 126;
    static_assert(sizeof(vec3) == 3 * sizeof(float));
    // A run with a position that is not finite is made again.
    constexpr std::size_t kRun = 256;
    MadePositions all;
    for (std::size_t first = 0; first < world.size(); first += kRun) {
        const std::size_t count = std::min(kRun, world.size() - first);
        std::size_t made = 0;
        if (std::abs(space_.exponent()) <= kMostExponent) {
            made = count / step_ * step_;
            const int flags =
                make_(&world[first].x, made, centre_, space_.exponent(), &scene[first].x);
            if ((flags & kNotFinite) != 0) {
                made = 0;
            } else {
                all.add({(flags & kOutside) != 0, (flags & kNotInvertible) == 0});
            }
        }
        for (std::size_t i = first + made; i < first + count; ++i) {
            const vec3 position = world[i];
            scene[i] = space_.to_scene(position);
            all.add({is_outside(position, scene[i]), space_.to_world(scene[i]) == position});
        }
    }
    return all;
}

}  // namespace mray::cpu

#endif  // HWY_ONCE
