// Traces packets of rays with a common origin: camera rays, and shadow rays of a light.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "common/bvh/bvh.h"
#include "common/interop/camera.h"
#include "common/interop/ray.h"
#include "common/scene/scene_space.h"
#include "common/simd/simd_target.h"
#include "cpu/packet/packets.h"

namespace mray::cpu {

static_assert(kStoredTileSide == kCameraSide);

/// Closest and any hits in a tree, which must outlive the tracer, with the bits of ScalarTracer.
/// Threads may share a tracer; each needs packets of its own, which are scratch memory.
class PacketTracer {
public:
    PacketTracer(const Bvh& bvh, SimdTarget target, PacketUse use = PacketUse::kAlways);

    PacketUse use() const { return use_; }

    /// Sets hits[y * stride + x] to the closest hit, or a miss, of the camera ray of pixel
    /// (tile.x0 + x, tile.y0 + y). The tile has 1 to 64 pixels on each side. Returns false, and
    /// sets nothing, if the packet is given up. Sets packet.leaf_count.
    bool intersect_camera(const ImageParams& params, const Tile& tile, CameraPacket& packet,
                          Hit* hits, std::size_t stride) const {
        return intersect_(*bvh_, use_, params, tile, packet, hits, stride);
    }

    /// Sets hits[y * kCameraSide + x] to the closest hit, or a miss, of stored ray (x, y). Its t is
    /// for the ray's canonical direction. Returns false, and sets nothing, if the rays do not all
    /// start at one point with tnear <= 0 and tfar infinite, or do not lie nearly on a grid, or
    /// if the packet is given up. `directions` is scratch memory.
    bool intersect_stored(const StoredRayTile& rays, StoredDirections& directions,
                          CameraPacket& packet, Hit* hits) const {
        return intersect_stored_(*bvh_, use_, rays, directions, packet, hits);
    }

    /// Sets occluded[i] to 0 where ray i, which starts at org, hits nothing, and to 1 where it hits
    /// something or is absent. rays: one to four times kSquareBlocks, with indices as in
    /// light_packet_ray(). Some rays have too little in common with the others to be traced here,
    /// and all are left if the packet is given up: the indices of these fallback rays are written
    /// to `fallback`, which has room for all rays, and their occluded[i] means nothing. Returns the
    /// number of fallback rays.
    std::size_t occluded_shared_origin(vec3 org, std::span<const SharedOriginRays> rays,
                                       LightPacket& packet, std::uint8_t* occluded,
                                       std::uint16_t* fallback) const {
        return occluded_(*bvh_, use_, org, rays, packet, occluded, fallback);
    }

private:
    const Bvh* bvh_;
    PacketUse use_;
    bool (*intersect_)(const Bvh&, PacketUse, const ImageParams&, const Tile&, CameraPacket&, Hit*,
                       std::size_t);
    bool (*intersect_stored_)(const Bvh&, PacketUse, const StoredRayTile&, StoredDirections&,
                              CameraPacket&, Hit*);
    std::size_t (*occluded_)(const Bvh&, PacketUse, vec3, std::span<const SharedOriginRays>,
                             LightPacket&, std::uint8_t*, std::uint16_t*);
};

}  // namespace mray::cpu
