// The surface that a pixel shows.
#include "common/interop/camera.h"
#include "common/interop/surface.h"
#include "shaders/base/scene.glsl"

Surface pixel_surface(Ray ray, Hit hit, uvec4 triangle) {
    return surface_at(ray, hit, scene_vertex(triangle.x), scene_vertex(triangle.y),
                      scene_vertex(triangle.z));
}
