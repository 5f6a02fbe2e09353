// Small scenes on which intersection rules fail.
#pragma once

#include <string>
#include <vector>

#include "common/scene/mesh.h"

namespace mray::accuracy {

struct FailureScene {
    std::string name;
    Topology topology;
    /// In world space.
    std::vector<vec3> positions;
};

/// The same scenes in every run: a sphere, far from 0, tiny and huge; needles and slivers; a fan of
/// thin triangles around one vertex; duplicate and coplanar triangles; details of 1 in an extent of
/// 1e6; an axis-aligned box; a soup.
std::vector<FailureScene> failure_scenes();

}  // namespace mray::accuracy
