// Tiles of an image: packets where rays share an origin, the single-ray tracer elsewhere.
#pragma once

#include <tbb/enumerable_thread_specific.h>

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "cpu/image/image_tracer.h"
#include "cpu/image/pixel_shader.h"
#include "cpu/packet/packet_tracer.h"
#include "cpu/single_ray/single_ray_tracer.h"

namespace mray::cpu {

/// The shadow rays of a tile, with indices as by light_packet_ray().
struct ShadowRays {
    std::vector<SharedOriginRays> rays;
    /// The `lit` of PixelShader::make_shadow_rays().
    std::vector<LitPixels> lit;
    std::vector<std::uint8_t> occluded;
};

/// Tells how large triangles are where the shadow rays of a tile end: the number of rays, and of
/// the leaves that the camera packet of the same pixels visited. Zeros: not known.
struct TileCounts {
    std::size_t rays = 0;
    std::size_t camera_leaves = 0;
};

/// The fastest tracer of tiles that a SIMD target has, with the bits of all others. Threads may
/// share one.
class TileTracer {
public:
    /// kAlways: for measurements.
    TileTracer(const Bvh& bvh, SimdTarget target, PacketUse use = PacketUse::kWhereItPays)
        : packets_(bvh, target, use), single_rays_(bvh, target), shader_(target) {}

    const PixelShader& shader() const { return shader_; }

    /// As PacketTracer::intersect_camera(), but answers all rays. Returns how many leaves the
    /// camera packet visited, for TileCounts.
    std::uint32_t intersect_camera(const ImageParams& params, const Tile& tile, Hit* hits,
                                   std::size_t stride) const;

    /// Sets occluded[i] to 0 if there is a ray i from org and it hits nothing, else to 1; indices
    /// as by light_packet_ray().
    void occluded_shared_origin(vec3 org, std::span<const SharedOriginRays> rays,
                                std::span<std::uint8_t> occluded,
                                const TileCounts& counts = {}) const;

    bool intersect_stored(const StoredRayTile& rays, Hit* hits) const {
        Packets& packets = scratch();
        return packets_.intersect_stored(rays, packets.directions, packets.camera, hits);
    }

    void intersect(std::span<const Ray> rays, std::span<Hit> hits) const {
        single_rays_.intersect(rays, hits);
    }
    void occluded(std::span<const Ray> rays, std::span<std::uint8_t> occluded) const {
        single_rays_.occluded(rays, occluded);
    }

    /// Memory for the shadow rays of a tile, of this thread.
    ShadowRays& shadow_rays() const { return scratch().shadow; }

    /// intersect_camera() without packets.
    void intersect_streams(const ImageParams& params, const Tile& tile, Hit* hits,
                           std::size_t stride) const;

private:
    /// The packets and rays of a thread, which are too large to be made for each tile.
    struct Packets {
        CameraPacket camera;
        LightPacket light;
        StoredDirections directions;
        ShadowRays shadow;
    };

    Packets& scratch() const {
        std::unique_ptr<Packets>& packets = packets_of_threads_.local();
        if (packets == nullptr) packets = std::make_unique<Packets>();
        return *packets;
    }

    PacketTracer packets_;
    SingleRayTracer single_rays_;
    PixelShader shader_;
    mutable tbb::enumerable_thread_specific<std::unique_ptr<Packets>> packets_of_threads_;
};

/// trace_tile() of image_tracer.h with the same bits, also shading with SIMD. Asks the watch before
/// secondary rays, and for each few thousand of those of ambient occlusion.
void trace_tile(const TileTracer& tracer, const ShadedMesh& mesh, const ImageParams& params,
                const Tile& tile, Frame& frame, const Watch& watch = {});

}  // namespace mray::cpu
