// Camera, parameters of an image, and camera rays.
#if !defined(COMMON_INTEROP_CAMERA_H) || defined(SHARED_LANES)
#ifndef COMMON_INTEROP_CAMERA_H
#define COMMON_INTEROP_CAMERA_H

#include "common/interop/arithmetic.h"
#include "common/interop/ray.h"

#endif

SHARED_BEGIN

#ifndef SHARED_LANES

// The rays of an image: closest hits; those and one shadow ray each; those and ambient occlusion.
SHARED_CONST uint kRaysPrimary = 0u;
SHARED_CONST uint kRaysShadow = 1u;
SHARED_CONST uint kRaysAo = 2u;

/// A pinhole camera in scene space: the ray of pixel (x, y), y downwards, goes from org through
/// (corner + du * (x + 0.5)) + dv * (y + 0.5), a point at depth 1 along the viewing direction as
/// seen from org. No component is a denormal: 0 or at least 2^-60 in magnitude.
struct Camera {
    vec3 org;
    float pad0;
    vec3 corner;
    float pad1;
    vec3 du;
    float pad2;
    vec3 dv;
    float pad3;
};

/// An image to trace. light is in scene space on the coordinate grid; ao_tfar is the length of the
/// ambient-occlusion rays in scene space, ao_count how many a pixel gets (1 to 256).
struct ImageParams {
    Camera camera;
    vec3 light;
    float ao_tfar;
    uint width, height;
    uint rays, ao_count;
};

#endif

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

#if defined(__cplusplus) && !defined(SHARED_LANES)
static_assert(sizeof(mray::Camera) == 64 && sizeof(mray::ImageParams) == 96);
#endif

#endif  // per Float type
