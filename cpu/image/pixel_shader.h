// What comes after the hits of a camera's rays: surfaces, the rays that start there, and colours.
#pragma once

#include <cstdint>
#include <vector>

#include "common/image/frame.h"
#include "common/simd/simd_target.h"
#include "cpu/image/shaded_mesh.h"
#include "cpu/image/tile.h"
#include "cpu/packet/packet.h"

namespace morphray::cpu {

/// Some of an image's pixels whose camera rays have been answered: the hits of the frame are
/// there, occlusion and pixels are about to be.
struct PixelPart {
    const ImageParams& params;
    const ShadedMesh& mesh;
    Tile tile;
    Frame& frame;
};

/// Pixels in blocks of 4 x 4 with the bits of surface_at(), shadow_ray(), ao_ray() and shade(),
/// which vectors of them go through operation by operation. Threads may share one; each call is
/// about pixels that nobody else is writing.
class PixelShader {
public:
    explicit PixelShader(SimdTarget target);

    /// Colours by a light at the eye; occlusion becomes 0. Any part.
    void shade_camera(const PixelPart& part) const { shade_camera_(part); }

    /// The shadow rays of a part of at most kLightPacketSide x kLightPacketSide pixels, indices as
    /// by light_packet_ray(); of `lit`, by the same indices, what shade_shadows() wants to know.
    /// Blocks that have no pixel of the part are left alone. Returns whether there is a ray.
    bool make_shadow_rays(const PixelPart& part, SharedOriginRays* rays, float* lit) const {
        return make_shadow_rays_(part, rays, lit);
    }

    /// Occlusion and colours, given for each of these rays 0 if it hits nothing, else 1.
    void shade_shadows(const PixelPart& part, const std::uint8_t* occluded,
                       const float* lit) const {
        shade_shadows_(part, occluded, lit);
    }

    /// The ambient-occlusion rays of a part, ao_count for each hit, one after the other.
    void make_ao_rays(const PixelPart& part, std::vector<Ray>& rays) const {
        make_ao_rays_(part, rays);
    }

    /// Occlusion and colours, given for each of these rays 0 if it hits nothing, else 1.
    void shade_ao(const PixelPart& part, const std::uint8_t* occluded) const {
        shade_ao_(part, occluded);
    }

private:
    void (*shade_camera_)(const PixelPart&);
    bool (*make_shadow_rays_)(const PixelPart&, SharedOriginRays*, float*);
    void (*shade_shadows_)(const PixelPart&, const std::uint8_t*, const float*);
    void (*make_ao_rays_)(const PixelPart&, std::vector<Ray>&);
    void (*shade_ao_)(const PixelPart&, const std::uint8_t*);
};

}  // namespace morphray::cpu
