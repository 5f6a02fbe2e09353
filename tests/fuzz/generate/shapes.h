// Meshes of about size 1 on which tracers fail.
#pragma once

#include <vector>

#include "common/scene/mesh.h"
#include "tests/fuzz/generate/dice.h"

namespace mray::fuzz {

struct Shape {
    std::vector<dvec3> positions;
    std::vector<uvec3> triangles;
};

/// A shape of any kind, mostly of 1 to 40 triangles, rarely of up to 2000.
Shape make_shape(Dice& dice);

}  // namespace mray::fuzz
