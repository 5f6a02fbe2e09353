// Rays of a caller's space, brought into scene space many at a time.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "common/interop/ray.h"
#include "common/scene/scene_space.h"
#include "common/scene/stored_rays.h"
#include "common/simd/simd_target.h"

namespace mray::cpu {

/// Rays in scene space that come from those of a caller.
struct SceneRays {
    static constexpr std::size_t kMost = 1024;

    Ray rays[kMost];
    /// [2 i + 1] belongs to ray i: t in the caller's space is t in scene space times 2^t_exponent.
    std::int32_t t_exponents[2 * kMost];
    /// The rays, ascending, that are not set.
    std::uint16_t hard[kMost];
    std::size_t hard_count;
};

/// Makes the rays of to_scene() (common/scene/scene_space.h), with their bits, on vectors. Threads
/// may share one.
class SceneRayMaker {
public:
    SceneRayMaker(const SceneSpace& space, const SimdTarget& target);

    /// Makes at most SceneRays::kMost rays. Leaves out rays that to_scene() refuses, and those with
    /// numbers that need more than floats: these are hard, and to_scene() decides.
    void make(std::span<const StoredRay> rays, SceneRays& out) const;

private:
    using Make = void (*)(const StoredRay*, std::size_t, const float*, int, SceneRays&);

    float centre_[3];
    int exponent_;
    Make make_;
};

}  // namespace mray::cpu
