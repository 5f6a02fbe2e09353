// Meshes that drivers are tried on, besides the scenes of a user.
#pragma once

#include <vector>

#include "accuracy/measure/failure_scenes.h"

namespace mray::accuracy {

/// failure_scenes(), and closed meshes: a sphere with T-joints that triangles without an area
/// close, one with collapsed vertices, and one of needles, stretched along an axis.
std::vector<FailureScene> suspect_scenes();

}  // namespace mray::accuracy
