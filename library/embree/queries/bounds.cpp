// rtcGetSceneBounds.
#include "library/embree/device.h"
#include "library/embree/scene/scene.h"

namespace mray::embree {
namespace {

/// Encloses the triangles that can be hit, and no vertex that none of them has.
RTCBounds bounds_of(const SceneObject& scene) {
    Bounds bounds;
    for (const Part& part : scene.committed().parts) bounds.add(part.bounds);
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
    with<SceneObject>("rtcGetSceneBounds", scene, [&](SceneObject& s) {
        if (bounds == nullptr) fail_argument("the bounds are null");
        *bounds = bounds_of(s);
    });
}

void rtcGetSceneLinearBounds(RTCScene scene, struct RTCLinearBounds* bounds) {
    with<SceneObject>("rtcGetSceneLinearBounds", scene, [&](SceneObject& s) {
        if (bounds == nullptr) fail_argument("the bounds are null");
        bounds->bounds0 = bounds_of(s);
        bounds->bounds1 = bounds->bounds0;
    });
}
