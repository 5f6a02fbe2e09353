// Rays and positions of a caller's space, brought into scene space many at a time, on vectors.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "common/interop/ray.h"
#include "common/scene/scene_space.h"
#include "common/simd/simd_target.h"

namespace mray::cpu {

/// Rays of a caller in scene space.
struct SceneRays {
    static constexpr std::size_t kMost = 1024;

    Ray rays[kMost];
    /// [2 i + 1] belongs to ray i: t in the caller's space is t in scene space times 2^t_exponent.
    std::int32_t t_exponents[2 * kMost];
    /// The rays, ascending, that are not set.
    std::uint16_t hard[kMost];
    std::size_t hard_count;
};

/// Makes the rays of to_scene() (common/scene/scene_space.h), with their bits, of at most
/// SceneRays::kMost rays. Leaves out rays that to_scene() refuses, and those with numbers that need
/// more than floats: these are hard, and to_scene() decides.
void make_scene_rays(const SceneSpace& space, const SimdTarget& target,
                     std::span<const StoredRay> rays, SceneRays& out);

/// The result of positions that were brought into scene space.
struct MadePositions {
    /// Whether one that is not left out lies outside of [-kSceneExtent, kSceneExtent] on an axis.
    bool any_outside = false;
    /// Whether one is not finite or beyond the limit of the space.
    bool any_left_out = false;
    /// Whether SceneSpace::to_world() gives each of them back. It does not for a position that is
    /// left out, and may not for one outside of the range or with a coordinate below 2^-36 of it.
    bool all_invertible = true;

    void extend(const MadePositions& other) {
        any_outside |= other.any_outside;
        any_left_out |= other.any_left_out;
        all_invertible &= other.all_invertible;
    }
};

/// Writes the positions of SceneSpace::to_scene(), with their bits, to `scene`, which has as many.
/// Slow for all of them if one is left out.
MadePositions make_positions(const SceneSpace& space, const SimdTarget& target,
                             std::span<const vec3> world, std::span<vec3> scene);

}  // namespace mray::cpu
