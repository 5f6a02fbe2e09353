// What a clip's vertices are at a frame.
#pragma once

#include <vector>

#include "scenes/clip.h"

namespace mray::test {

inline std::vector<vec3> positions_at(const Clip& clip, double frame) {
    std::vector<vec3> positions(clip.topology().vertex_count);
    clip.positions(frame, positions);
    return positions;
}

}  // namespace mray::test
