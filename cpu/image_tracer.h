// An image from any tracer with intersect(ray) and occluded(ray), one rectangle of pixels at a
// time.
#pragma once

#include <span>

#include "common/frame.h"
#include "common/interop/camera.h"
#include "common/interop/shade.h"
#include "common/mesh.h"

namespace morphray::cpu {

/// Pixels [x0, x1) x [y0, y1).
struct Tile {
    std::uint32_t x0, y0, x1, y1;
};

/// What shading needs besides hits.
struct ShadedMesh {
    const Topology* topology;
    std::span<const vec3> positions;

    Surface surface(const Ray& ray, const Hit& hit) const {
        const uvec3 t = topology->triangles[hit.prim_id];
        return surface_at(ray, hit, positions[t.x], positions[t.y], positions[t.z]);
    }
};

/// The number of occluded secondary rays of pixel (x, y).
template <class Tracer>
std::uint32_t count_occluded(const Tracer& tracer, const ImageParams& params,
                             const Surface& surface, std::uint32_t x, std::uint32_t y) {
    if (params.rays == kRaysShadow) {
        return !faces_light(surface, params.light) ||
               tracer.occluded(shadow_ray(surface, params.light));
    }
    std::uint32_t occluded = 0;
    if (params.rays == kRaysAo) {
        for (std::uint32_t i = 0; i < params.ao_count; ++i) {
            occluded += tracer.occluded(ao_ray(surface, x, y, i, params.ao_tfar));
        }
    }
    return occluded;
}

/// Fills hits, occlusion and pixels of the tile. Tiles of one frame may be traced by several
/// threads.
template <class Tracer>
void trace_tile(const Tracer& tracer, const ShadedMesh& mesh, const ImageParams& params, Tile tile,
                Frame& frame) {
    for (std::uint32_t y = tile.y0; y < tile.y1; ++y) {
        for (std::uint32_t x = tile.x0; x < tile.x1; ++x) {
            const std::size_t pixel = std::size_t{y} * params.width + x;
            const Ray ray = camera_ray(params.camera, x, y);
            const Hit hit = tracer.intersect(ray);
            frame.hits[pixel] = hit;
            frame.occlusion[pixel] = 0;
            if (hit.prim_id == kNoPrim) {
                frame.pixels[pixel] = background(y, params.height);
                continue;
            }
            const Surface surface = mesh.surface(ray, hit);
            const std::uint32_t occluded = count_occluded(tracer, params, surface, x, y);
            frame.occlusion[pixel] = occluded;
            frame.pixels[pixel] =
                shade(params, ray, surface, mesh.topology->albedo[hit.prim_id], occluded);
        }
    }
}

}  // namespace morphray::cpu
