// Tiles of an image by any tracer: packets where rays share an origin, single rays elsewhere.
#pragma once

#include <tbb/enumerable_thread_specific.h>

#include <memory>
#include <utility>

#include "common/base/watch.h"
#include "cpu/image/pixel_shader.h"
#include "cpu/packet/packet_tracer.h"
#include "cpu/single_ray/single_ray_tracer.h"

namespace mray::cpu {

/// Tells how large triangles are where the shadow rays of a tile end: the number of rays, and of
/// the leaves that the camera packet of the same pixels visited. Zeros: not known.
struct TileCounts {
    std::size_t rays = 0;
    std::size_t camera_leaves = 0;
};

/// Traces rays and tiles of at most 64 x 64 pixels, a TileTracer in packets. Threads may share one.
class ImageTracer {
public:
    /// shading: the instruction set that makes rays and colours.
    explicit ImageTracer(SimdTarget shading) : shader_(shading) {}
    virtual ~ImageTracer() = default;

    virtual void intersect(std::span<const Ray> rays, std::span<Hit> hits) const = 0;
    /// occluded[i] becomes 0 if ray i hits nothing, else 1.
    virtual void occluded(std::span<const Ray> rays, std::span<std::uint8_t> occluded) const = 0;

    /// As PacketTracer::intersect_stored().
    virtual bool intersect_stored(const StoredRayTile&, Hit*) const { return false; }

    /// Sets hits[y * stride + x] for each camera ray of the tile. Returns the packet that found
    /// them, the calling thread's until its next call, or null. Tracers without packets read the
    /// watch between rays.
    virtual const CameraPacket* intersect_camera(const ImageParams& params, const Tile& tile,
                                                 Hit* hits, std::size_t stride,
                                                 const Watch& watch = {}) const;

    /// Sets occluded[i] to 0 if ray i exists and hits nothing, else 1; as by light_packet_ray().
    virtual void occluded_shared_origin(vec3 org, std::span<const SharedOriginRays> rays,
                                        std::span<std::uint8_t> occluded,
                                        const TileCounts& counts = {}) const;

    /// Fills hits, unless the frame has them, occlusion and pixels of a tile. Returns the number of
    /// secondary rays: rays_per_hit() for each hit. Throws Error(kCancelled), leaving anything in
    /// the tile, soon after the watch asks for it.
    std::size_t trace_tile(const ShadedMesh& mesh, const ImageParams& params, const Tile& tile,
                           Frame& frame, const Watch& watch) const;

protected:
    void occluded_among(vec3 org, std::span<const SharedOriginRays> rays,
                        std::span<const std::uint16_t> indices,
                        std::span<std::uint8_t> occluded) const;

private:
    // Return the number of secondary rays.
    std::size_t trace_shadows(const ImageRegion& region) const;
    std::size_t trace_ao(const ImageRegion& region, const Watch& watch) const;

    /// The shadow rays of a tile, with indices as by light_packet_ray().
    struct ShadowRays {
        std::vector<SharedOriginRays> rays;
        std::vector<LitPixels> lit;
        std::vector<std::uint8_t> occluded;
    };

    PixelShader shader_;
    mutable tbb::enumerable_thread_specific<ShadowRays> shadow_rays_;
};

/// Makes an ImageTracer without SIMD of a tracer of single rays.
template <class Tracer>
class OneByOne final : public ImageTracer {
public:
    explicit OneByOne(Tracer tracer)
        : ImageTracer(find_simd_target("scalar")), tracer_(std::move(tracer)) {}

    void intersect(std::span<const Ray> rays, std::span<Hit> hits) const override {
        for (std::size_t i = 0; i < rays.size(); ++i) hits[i] = tracer_.intersect(rays[i]);
    }
    void occluded(std::span<const Ray> rays, std::span<std::uint8_t> occluded) const override {
        for (std::size_t i = 0; i < rays.size(); ++i) occluded[i] = tracer_.occluded(rays[i]);
    }

private:
    Tracer tracer_;
};

/// The fastest tracer of tiles that a SIMD target has, with the bits of all others.
class TileTracer final : public ImageTracer {
public:
    /// kAlways: for measurements.
    TileTracer(const Bvh& bvh, SimdTarget target, PacketUse use = PacketUse::kWhereItPays)
        : ImageTracer(target), packets_(bvh, target, use), single_rays_(bvh, target) {}

    void intersect(std::span<const Ray> rays, std::span<Hit> hits) const override {
        single_rays_.intersect(rays, hits);
    }
    void occluded(std::span<const Ray> rays, std::span<std::uint8_t> occluded) const override {
        single_rays_.occluded(rays, occluded);
    }
    bool intersect_stored(const StoredRayTile& rays, Hit* hits) const override {
        Packets& packets = scratch();
        return packets_.intersect_stored(rays, packets.directions, packets.camera, hits);
    }
    const CameraPacket* intersect_camera(const ImageParams& params, const Tile& tile, Hit* hits,
                                         std::size_t stride,
                                         const Watch& watch = {}) const override;
    void occluded_shared_origin(vec3 org, std::span<const SharedOriginRays> rays,
                                std::span<std::uint8_t> occluded,
                                const TileCounts& counts = {}) const override;

private:
    /// The packets of a thread, which are too large to be made for each tile.
    struct Packets {
        CameraPacket camera;
        LightPacket light;
        StoredDirections directions;
    };

    Packets& scratch() const {
        std::unique_ptr<Packets>& packets = packets_of_threads_.local();
        if (packets == nullptr) packets = std::make_unique<Packets>();
        return *packets;
    }

    PacketTracer packets_;
    SingleRayTracer single_rays_;
    mutable tbb::enumerable_thread_specific<std::unique_ptr<Packets>> packets_of_threads_;
};

}  // namespace mray::cpu
