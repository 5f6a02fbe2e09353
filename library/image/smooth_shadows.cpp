#include "library/image/smooth_shadows.h"

#include <cstddef>
#include <optional>
#include <vector>

#include "common/interop/camera.h"
#include "common/interop/lit.h"
#include "common/scene/vertex_normals.h"

namespace morphray::detail {
namespace {

/// The smooth surface above a hit of a flat one; nothing if all corners are flat.
std::optional<mray::Surface> surface_above(const TracedScene& scene, const SmoothCorners& corners,
                                           const mray::Surface& flat, const mray::Hit& hit) {
    const mray::uvec3 ids = corners.ids[hit.prim_id];
    const mray::uvec3 t = scene.mesh.topology->triangles[hit.prim_id];
    mray::vec3 places[3], normals[3];
    bool is_flat = true;
    for (int k = 0; k < 3; ++k) {
        places[k] = scene.mesh.positions[t[k]];
        normals[k] = flat.normal;
        if (ids[k] == mray::kFlatCorner) continue;
        normals[k] = mray::corner_normal(corners.normals[ids[k]], flat.normal);
        is_flat = false;
    }
    if (is_flat) return std::nullopt;
    return mray::smooth_surface(flat, places[0], places[1], places[2], normals[0], normals[1],
                                normals[2], hit.u, hit.v);
}

}  // namespace

std::uint64_t light_smooth_surfaces(const TracedScene& scene, const SmoothCorners& corners,
                                    TracedImage& image) {
    const mray::ImageParams& params = image.params;
    std::vector<std::uint32_t>& shadows = image.samples.occlusion;
    const auto ask = [&](std::uint32_t y, RayBatch& batch) {
        for (std::uint32_t x = 0; x < params.width; ++x) {
            const std::size_t sample = std::size_t{y} * params.width + x;
            if (shadows[sample] == 0) continue;
            const mray::Hit& hit = image.samples.hits[sample];
            if (hit.prim_id == mray::kNoPrim) continue;
            const mray::Surface flat =
                scene.mesh.surface(mray::camera_ray(params.camera, x, y), hit);
            const std::optional<mray::Surface> above = surface_above(scene, corners, flat, hit);
            if (!above || above->point == flat.point) continue;
            if (!(mray::dot3(above->normal, params.light - flat.point) > 0.0f)) continue;
            batch.add(mray::shadow_ray(*above, params.light), sample);
            batch.add(mray::ray_between(flat, *above), sample);
        }
    };
    SampleRays rays(scene);
    rays.in_batches(params.width, params.height, 2, ask, [&](const RayBatch& batch) {
        const std::span<const mray::Hit> hits = rays.trace(batch);
        for (const std::size_t sample : batch.samples) shadows[sample] = 0;
        for (std::size_t i = 0; i < hits.size(); ++i) {
            if (hits[i].prim_id != mray::kNoPrim) shadows[batch.samples[i]] = 1;
        }
    });
    return rays.ray_count();
}

}  // namespace morphray::detail
