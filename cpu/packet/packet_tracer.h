// Packets of rays with a common origin over the shared layout: what camera and shadow rays are
// traced by.
#pragma once

#include <cstdint>
#include <span>

#include "common/bvh/bvh.h"
#include "common/interop/params.h"
#include "common/interop/ray.h"
#include "common/simd/simd_target.h"
#include "cpu/image/tile.h"
#include "cpu/packet/packet.h"

namespace morphray::cpu {

/// Closest and any hit over a tree that outlives it, with the bits of ScalarTracer. Threads may
/// share one, each with packets of its own.
class PacketTracer {
public:
    PacketTracer(const Bvh& bvh, SimdTarget target);

    /// hits[y * stride + x] answers camera_ray(params.camera, tile.x0 + x, tile.y0 + y), for a tile
    /// of at most 64 x 64 pixels.
    void intersect_camera(const ImageParams& params, const Tile& tile, Packet& packet, Hit* hits,
                          std::size_t stride) const;

    /// occluded[i] becomes 0 where ray i, which starts at org, hits nothing, and 1 where it does or
    /// there is none; one to four times kSquareBlocks of rays, indices as by light_packet_ray().
    /// Of some nothing is said, because they have too little in common with the others to be traced
    /// along; their indices are written to `left`, which has room for all. Returns how many.
    std::size_t occluded_shared_origin(vec3 org, std::span<const SharedOriginRays> rays,
                                       Packet& packet, std::uint8_t* occluded,
                                       std::uint16_t* left) const;

private:
    using Camera = void (*)(const Bvh&, const ImageParams&, const Tile&, Packet&, Hit*,
                            std::size_t);
    using Point = std::size_t (*)(const Bvh&, vec3, const SharedOriginRays*, std::uint32_t, Packet&,
                                  std::uint8_t*, std::uint16_t*);

    const Bvh* bvh_;
    Camera camera_;
    Point point_;
};

}  // namespace morphray::cpu
