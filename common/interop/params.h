// Camera and parameters of an image.
#ifndef COMMON_INTEROP_PARAMS_H
#define COMMON_INTEROP_PARAMS_H

#include "common/interop/platform.h"

SHARED_BEGIN

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
    uint width;
    uint height;
    uint rays;
    uint ao_count;
};

SHARED_END

#ifdef __cplusplus
static_assert(sizeof(mray::Camera) == 64 && sizeof(mray::ImageParams) == 96);
#endif

#endif  // COMMON_INTEROP_PARAMS_H
