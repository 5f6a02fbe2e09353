// Cameras, lights and single rays.
#pragma once

#include <string>
#include <vector>

#include "common/scene/camera_setup.h"
#include "common/scene/scene_space.h"
#include "tests/fuzz/generate/places.h"

namespace mray::fuzz {

/// An image of at most `tests` ray-triangle tests of brute force.
ViewSpec make_view(Dice& dice, const Surroundings& around, double tests);

/// Rays at vertices, edges and along planes, many of which start on a surface or just off it.
std::vector<WorldRay> make_rays(Dice& dice, const Surroundings& around, std::size_t count);

/// Groups of rays from one place each to places near each other.
std::vector<WorldRay> make_ray_groups(Dice& dice, const Surroundings& around, std::size_t groups,
                                      std::size_t size);

}  // namespace mray::fuzz
