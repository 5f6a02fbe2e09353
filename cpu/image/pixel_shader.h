// From the hits of camera rays to surfaces, secondary rays and colours, with SIMD.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/image/frame.h"
#include "common/interop/surface.h"
#include "common/scene/mesh.h"
#include "common/simd/simd_target.h"
#include "cpu/packet/packets.h"

namespace mray::cpu {

/// The mesh that shading takes surfaces and albedos from.
struct ShadedMesh {
    const Topology* topology;
    std::span<const vec3> positions;

    Surface surface(const Ray& ray, const Hit& hit) const {
        const uvec3 t = topology->triangles[hit.prim_id];
        return surface_at(ray, hit, positions[t.x], positions[t.y], positions[t.z]);
    }
};

/// A rectangle of an image, whose frame has the hits; occlusion and, with_pixels, pixels are
/// written.
struct ImageRegion {
    const ImageParams& params;
    const ShadedMesh& mesh;
    Tile tile;
    Frame& frame;
    /// The packet that has found the hits of a tile with this region, or null: it makes shading
    /// faster and changes no bit.
    const CameraPacket* packet = nullptr;
};

/// The pixels of a block that a light shines on: how bright each is where it is lit, above 0 where
/// it shows a triangle, and its albedo there if the frame has pixels.
struct alignas(64) LitPixels {
    float intensity[kBlockRays];
    Albedo albedo[kBlockRays];
};

/// The pixels of a region that show a triangle, and the ones with a shadow ray.
struct ShadowRayCounts {
    std::size_t hits = 0;
    std::size_t rays = 0;
};

/// Shades pixels in blocks of 4 x 4 with the bits of surface_at(), shadow_ray(), ao_ray() and
/// shade(). Threads may share one if their regions do not overlap.
struct PixelShader {
    explicit PixelShader(SimdTarget target);

    /// Makes the camera rays of a tile: of its blocks row by row, kBlockRays each, column by
    /// column. A block with pixels outside the tile has their rays, too.
    void (*make_camera_rays)(const ImageParams& params, const Tile& tile, Ray* rays);

    /// Writes the colours under a light at the eye, and occlusion 0. The region may have any size.
    void (*shade_camera)(const ImageRegion& region);

    /// Makes the shadow rays of a region of at most kLightPacketSide x kLightPacketSide pixels,
    /// indices as by light_packet_ray(), and what shade_shadows needs of its pixels, block by
    /// block as the rays. Blocks without a pixel of the region are not written.
    ShadowRayCounts (*make_shadow_rays)(const ImageRegion& region, SharedOriginRays* rays,
                                        LitPixels* lit);

    /// Writes occlusion and colours; occluded[i] is 0 if ray i hits nothing, else 1.
    void (*shade_shadows)(const ImageRegion& region, const std::uint8_t* occluded,
                          const LitPixels* lit);

    /// Makes the ambient-occlusion rays of a region: ao_count for each hit, one after the other.
    void (*make_ao_rays)(const ImageRegion& region, std::vector<Ray>& rays);

    /// Writes occlusion and colours; occluded[i] is 0 if ray i hits nothing, else 1.
    void (*shade_ao)(const ImageRegion& region, const std::uint8_t* occluded);
};

}  // namespace mray::cpu
