// rtcGetSceneBounds.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "embree/device.h"
#include "embree/scene/reading.h"
#include "embree/scene/scene.h"

namespace mray::embree {
namespace {

struct Bounds {
    std::array<float, 3> lower;
    std::array<float, 3> upper;

    Bounds() {
        lower.fill(std::numeric_limits<float>::infinity());
        upper.fill(-std::numeric_limits<float>::infinity());
    }
    void add(const morphray::Vec3& p) {
        const float point[3] = {p.x, p.y, p.z};
        for (std::size_t axis = 0; axis < 3; ++axis) {
            lower[axis] = std::min(lower[axis], point[axis]);
            upper[axis] = std::max(upper[axis], point[axis]);
        }
    }
};

bool is_finite(const morphray::Vec3& p) {
    return std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z);
}

void add_triangles(const Part& part, Bounds& bounds) {
    std::array<std::uint32_t, 3> corners;
    for (std::size_t i = 0; i < part.triangle_count(); ++i) {
        if (!part.find_corners(i, corners)) continue;
        std::array<morphray::Vec3, 3> points;
        for (std::size_t k = 0; k < 3; ++k) {
            points[k] = part.placed_vertex(corners[k]);
        }
        if (!std::all_of(points.begin(), points.end(), is_finite)) continue;
        for (const morphray::Vec3& p : points) bounds.add(p);
    }
}

/// Encloses the triangles that can be hit, and no vertex that none of them has.
RTCBounds bounds_of(const SceneObject& scene) {
    Bounds bounds;
    const Reading reading(scene);
    for (const Part& part : reading.committed().parts) add_triangles(part, bounds);
    RTCBounds result = {};
    result.lower_x = bounds.lower[0];
    result.lower_y = bounds.lower[1];
    result.lower_z = bounds.lower[2];
    result.upper_x = bounds.upper[0];
    result.upper_y = bounds.upper[1];
    result.upper_z = bounds.upper[2];
    return result;
}

}  // namespace
}  // namespace mray::embree

using namespace mray::embree;

void rtcGetSceneBounds(RTCScene scene, struct RTCBounds* bounds) {
    if (const Forward to = forward(scene)) return to->rtcGetSceneBounds(to.scene, bounds);
    with<SceneObject>("rtcGetSceneBounds", scene, [&](SceneObject& s) {
        if (bounds == nullptr) fail_argument("the bounds are null");
        *bounds = bounds_of(s);
    });
}

void rtcGetSceneLinearBounds(RTCScene scene, struct RTCLinearBounds* bounds) {
    if (const Forward to = forward(scene)) return to->rtcGetSceneLinearBounds(to.scene, bounds);
    with<SceneObject>("rtcGetSceneLinearBounds", scene, [&](SceneObject& s) {
        if (bounds == nullptr) fail_argument("the bounds are null");
        bounds->bounds0 = bounds_of(s);
        bounds->bounds1 = bounds->bounds0;
    });
}
