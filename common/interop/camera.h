// Camera rays.
#ifndef COMMON_INTEROP_CAMERA_H
#define COMMON_INTEROP_CAMERA_H

#include "common/interop/arithmetic.h"
#include "common/interop/params.h"
#include "common/interop/ray.h"

SHARED_BEGIN

/// From the eye through the centre of pixel (x, y), on the plane at depth 1.
SHARED vec3 camera_direction(Camera camera, uint x, uint y) {
    PRECISE float px = float(x) + 0.5f;
    PRECISE float py = float(y) + 0.5f;
    PRECISE float dx = (camera.corner.x + camera.du.x * px) + camera.dv.x * py;
    PRECISE float dy = (camera.corner.y + camera.du.y * px) + camera.dv.y * py;
    PRECISE float dz = (camera.corner.z + camera.du.z * px) + camera.dv.z * py;
    PRECISE vec3 d = vec3(dx, dy, dz);
    return d;
}

/// The ray of pixel (x, y), with tnear = 0 and no far end.
SHARED Ray camera_ray(Camera camera, uint x, uint y) {
    Ray ray;
    ray.org = camera.org;
    ray.tnear = 0.0f;
    ray.dir = canonical_direction(camera_direction(camera, x, y));
    ray.tfar = kInfiniteT;
    return ray;
}

/// t of camera_ray times this power of two is the depth along the viewing direction.
SHARED float camera_depth_scale(Camera camera, uint x, uint y) {
    return scale_to_unit(largest_component(camera_direction(camera, x, y)));
}

SHARED_END

#endif  // COMMON_INTEROP_CAMERA_H
