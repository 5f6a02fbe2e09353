// Positions of a caller's space, brought into scene space many at a time.
#pragma once

#include <cstddef>
#include <span>

#include "common/scene/scene_space.h"
#include "common/simd/simd_target.h"

namespace mray::cpu {

/// What a target finds of a run of positions: some are not finite; or all are, and some lie outside
/// of scene space.
enum MadePositions { kNotFinite, kSomeOutside, kAllInside };

/// Makes the positions of SceneSpace::to_scene(), with their bits, on vectors. Threads may share
/// one.
class ScenePositionMaker {
public:
    ScenePositionMaker(const SceneSpace& space, const SimdTarget& target);

    /// Writes as many positions. Returns whether a finite one lies outside of the range of scene
    /// space, [-kSceneExtent, kSceneExtent] on each axis.
    bool make(std::span<const vec3> world, std::span<vec3> scene) const;

private:
    using Make = int (*)(const float*, std::size_t, const float*, int, float*);

    SceneSpace space_;
    float centre_[3];
    Make make_;
    std::size_t step_;
};

}  // namespace mray::cpu
