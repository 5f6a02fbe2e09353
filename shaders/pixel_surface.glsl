// The point that a pixel shows.
#ifndef SHADERS_PIXEL_SURFACE_GLSL
#define SHADERS_PIXEL_SURFACE_GLSL

#include "common/interop/camera.h"
#include "common/interop/surface.h"
#include "shaders/scene.glsl"

Surface pixel_surface(Ray ray, Hit hit) {
    return surface_at(ray, hit, triangle_vertex(hit.prim_id, 0u),
                      triangle_vertex(hit.prim_id, 1u), triangle_vertex(hit.prim_id, 2u));
}

#endif  // SHADERS_PIXEL_SURFACE_GLSL
