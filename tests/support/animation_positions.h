// What an animation's vertices are at a frame.
#pragma once

#include <vector>

#include "scenes/animation.h"

namespace mray::test {

inline std::vector<vec3> positions_at(const Animation& animation, double frame) {
    std::vector<vec3> positions(animation.topology().vertex_count);
    animation.positions(frame, positions);
    return positions;
}

}  // namespace mray::test
