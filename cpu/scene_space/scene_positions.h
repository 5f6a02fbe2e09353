// Positions of a caller's space, brought into scene space many at a time.
#pragma once

#include <cstddef>
#include <span>

#include "common/scene/scene_space.h"
#include "common/simd/simd_target.h"

namespace mray::cpu {

/// The result of positions that were brought into scene space.
struct MadePositions {
    /// Whether a finite one lies outside of the range of scene space, [-kSceneExtent, kSceneExtent]
    /// on each axis.
    bool any_outside = false;
    /// Whether SceneSpace::to_world() gives each of them back. It does not for a position that is
    /// not finite, and may not for one outside of the range or with a coordinate below 2^-36 of it.
    bool all_invertible = true;

    void add(const MadePositions& other) {
        any_outside |= other.any_outside;
        all_invertible &= other.all_invertible;
    }
};

/// Makes the positions of SceneSpace::to_scene(), with their bits, on vectors. Threads may share
/// one.
class ScenePositionMaker {
public:
    ScenePositionMaker(const SceneSpace& space, const SimdTarget& target);

    /// Writes as many positions.
    MadePositions make(std::span<const vec3> world, std::span<vec3> scene) const;

private:
    using Make = int (*)(const float*, std::size_t, const float*, int, float*);

    SceneSpace space_;
    float centre_[3];
    Make make_;
    std::size_t step_;
};

}  // namespace mray::cpu
