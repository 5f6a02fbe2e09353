#include "library/src/image/smooth_shadows.h"

#include <cstddef>
#include <optional>
#include <vector>

#include "common/interop/camera.h"
#include "common/interop/lit.h"
#include "common/scene/vertex_normals.h"

namespace morphray::detail {
namespace {

/// The smooth surface above a hit of a flat one; nothing if all corners are flat.
std::optional<mray::Surface> surface_above(const mray::cpu::LitSamples& samples,
                                           const mray::Surface& flat, const mray::Hit& hit) {
    const mray::uvec3 ids = samples.normal_ids[hit.prim_id];
    const mray::uvec3 t = samples.topology.triangles[hit.prim_id];
    mray::vec3 places[3], normals[3];
    bool is_flat = true;
    for (int k = 0; k < 3; ++k) {
        places[k] = samples.positions[t[k]];
        normals[k] = flat.normal;
        if (ids[k] == mray::kFlatCorner) continue;
        normals[k] = mray::corner_normal(samples.normals[ids[k]], flat.normal);
        is_flat = false;
    }
    if (is_flat) return std::nullopt;
    return mray::smooth_surface(flat, places[0], places[1], places[2], normals[0], normals[1],
                                normals[2], hit.u, hit.v);
}

}  // namespace

std::uint64_t light_smooth_surfaces(const TracedScene& scene, const mray::cpu::LitShader& shader,
                                    const mray::cpu::LitSamples& samples,
                                    std::span<std::uint32_t> shadows) {
    // A shadow whose smooth surface sees the light.
    constexpr std::uint32_t kSeesLight = 2;
    const mray::ImageParams& params = samples.params;
    /// Adds ray_of(flat, above) for a sample, if a smooth surface is above it.
    const auto add_ray = [&](std::uint32_t x, std::uint32_t y, RayBatch& batch, auto ray_of) {
        const std::size_t sample = std::size_t{y} * params.width + x;
        const mray::Hit& hit = samples.hits[sample];
        const mray::Surface flat = scene.mesh.surface(mray::camera_ray(params.camera, x, y), hit);
        const std::optional<mray::Surface> above = surface_above(samples, flat, hit);
        if (above) batch.add(ray_of(flat, *above), sample);
    };
    SampleRays rays(scene);
    const auto from_light = [&](std::uint32_t y, RayBatch& batch) {
        std::vector<std::uint32_t> xs;
        shader.find_flat_shadows(samples, y, xs);
        for (const std::uint32_t x : xs) {
            add_ray(x, y, batch, [&](const mray::Surface&, const mray::Surface& above) {
                return mray::shadow_ray(above, params.light);
            });
        }
    };
    rays.in_batches(params.width, params.height, 1, from_light, [&](const RayBatch& batch) {
        const std::span<const std::uint8_t> is_occluded = rays.occluded(batch);
        for (std::size_t i = 0; i < is_occluded.size(); ++i)
            if (is_occluded[i] == 0) shadows[batch.samples[i]] = kSeesLight;
    });
    const auto from_triangle = [&](std::uint32_t y, RayBatch& batch) {
        for (std::uint32_t x = 0; x < params.width; ++x)
            if (shadows[std::size_t{y} * params.width + x] == kSeesLight)
                add_ray(x, y, batch, mray::ray_between);
    };
    rays.in_batches(params.width, params.height, 1, from_triangle, [&](const RayBatch& batch) {
        const std::span<const std::uint8_t> is_occluded = rays.occluded(batch);
        for (std::size_t i = 0; i < is_occluded.size(); ++i)
            shadows[batch.samples[i]] = is_occluded[i];
    });
    return rays.ray_count();
}

}  // namespace morphray::detail
