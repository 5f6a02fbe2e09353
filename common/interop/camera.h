// Camera rays.
#ifndef COMMON_INTEROP_CAMERA_H
#define COMMON_INTEROP_CAMERA_H

#include "common/interop/arithmetic.h"
#include "common/interop/params.h"
#include "common/interop/ray.h"

SHARED_BEGIN

/// The ray through the centre of pixel (x, y), with tnear = 0 and no far end.
SHARED Ray camera_ray(Camera camera, uint x, uint y) {
    PRECISE float px = float(x) + 0.5f;
    PRECISE float py = float(y) + 0.5f;
    PRECISE float dx = (camera.corner.x + camera.du.x * px) + camera.dv.x * py;
    PRECISE float dy = (camera.corner.y + camera.du.y * px) + camera.dv.y * py;
    PRECISE float dz = (camera.corner.z + camera.du.z * px) + camera.dv.z * py;
    Ray ray;
    ray.org = camera.org;
    ray.tnear = 0.0f;
    ray.dir = snap_direction(vec3(dx, dy, dz));
    ray.tfar = 1.2676506002282294e+30f;  // 2^100
    return ray;
}

SHARED_END

#endif  // COMMON_INTEROP_CAMERA_H
