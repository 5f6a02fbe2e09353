// Trees whose boxes are entered later than their triangles are hit, by as much as the depth margin
// allows for. Rounding makes such boxes, but far smaller ones: hill climbing over triangles and
// rays found no hit at all before its triangle's dilated box. So a tracer that forgets the margin
// would pass every test with real boxes.
#pragma once

#include <vector>

#include "common/bvh/bvh.h"
#include "common/interop/ray.h"
#include "common/scene/mesh.h"

namespace mray::test {

struct LateBoxes {
    Topology topology;
    /// Scene space.
    std::vector<vec3> positions;
    Bvh bvh;
};

/// A triangle 64 times: (-3, 0, -2), (3, 0, -2), (0, 0, 3), times 2^16. All boxes but that of the
/// leaf of triangle `on_time` (kNoPrim: all boxes) are below it in y, so that the rays enter them
/// later than they hit it by 7/16 of the depth margin, but not on their main axis.
LateBoxes late_boxes(std::uint32_t on_time);

/// Rays with the main axis z from (0, 3, 12) times 2^16 to points of the triangle.
std::vector<Ray> rays_at_late_boxes(std::size_t count);

}  // namespace mray::test
