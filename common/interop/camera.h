// Camera rays.
#if !defined(COMMON_INTEROP_CAMERA_H) || defined(SHARED_LANES)
#ifndef COMMON_INTEROP_CAMERA_H
#define COMMON_INTEROP_CAMERA_H

#include "common/interop/arithmetic.h"
#include "common/interop/params.h"
#include "common/interop/ray.h"

#endif

SHARED_BEGIN

/// From the eye through the centre of pixel (x, y), on the plane at depth 1.
SHARED Float3 camera_direction(Camera camera, Uint x, Uint y) {
    PRECISE Float px = to_float(x) + 0.5f;
    PRECISE Float py = to_float(y) + 0.5f;
    PRECISE Float dx = (camera.corner.x + camera.du.x * px) + camera.dv.x * py;
    PRECISE Float dy = (camera.corner.y + camera.du.y * px) + camera.dv.y * py;
    PRECISE Float dz = (camera.corner.z + camera.du.z * px) + camera.dv.z * py;
    PRECISE Float3 d = Float3(dx, dy, dz);
    return d;
}

#ifndef SHARED_LANES

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

#endif

SHARED_END

#endif  // per Float type
