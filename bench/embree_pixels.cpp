#include "bench/embree_pixels.h"

#include "bench/embree_records.h"
#include "common/interop/camera.h"
#include "common/interop/surface.h"

namespace morphray::bench {
namespace {

Hit intersect(RTCScene scene, RTCIntersectContext& context, const Ray& ray) {
    RTCRayHit record;
    set_ray(record.ray, 0, ray);
    record.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    record.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
    rtcIntersect1(scene, &context, &record);
    if (record.hit.geomID == RTC_INVALID_GEOMETRY_ID) return no_hit();
    return {record.ray.tfar, record.hit.u, record.hit.v, record.hit.primID};
}

bool occluded(RTCScene scene, RTCIntersectContext& context, const Ray& ray) {
    RTCRay record;
    set_ray(record, 0, ray);
    rtcOccluded1(scene, &context, &record);
    return record.tfar < 0;
}

/// How many of the rays from a surface are occluded; the light is, where the surface faces away.
std::uint32_t count_occluded(RTCScene scene, RTCIntersectContext& context,
                             const ImageParams& params, const Surface& surface, std::uint32_t x,
                             std::uint32_t y) {
    if (params.rays == kRaysShadow) {
        return !faces_light(surface, params.light) ||
               occluded(scene, context, shadow_ray(surface, params.light));
    }
    std::uint32_t count = 0;
    for (std::uint32_t sample = 0; sample < params.ao_count; ++sample) {
        count += occluded(scene, context, ao_ray(surface, x, y, sample, params.ao_tfar));
    }
    return count;
}

}  // namespace

void trace_pixels(const EmbreeScene& scene, const TraceWork& work, const cpu::ShadedMesh& mesh,
                  std::span<const Hit> seen, Frame& frame) {
    const ImageParams& params = work.params;
    for_each_tile(work, [&](const TileRays& rays) {
        const FlushedDenormals flushed;
        RTCIntersectContext context =
            make_context(params.rays == kRaysAo ? RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT
                                                : RTC_INTERSECT_CONTEXT_FLAG_COHERENT);
        for_each_pixel(rays.tile, [&](std::uint32_t x, std::uint32_t y) {
            const std::size_t pixel = std::size_t{y} * params.width + x;
            const Ray ray = camera_ray(params.camera, x, y);
            if (params.rays == kRaysPrimary) {
                frame.hits[pixel] = intersect(scene.handle(), context, ray);
            } else if (seen[pixel].prim_id != kNoPrim) {
                frame.occlusion[pixel] = count_occluded(scene.handle(), context, params,
                                                        mesh.surface(ray, seen[pixel]), x, y);
            }
        });
    });
}

}  // namespace morphray::bench
