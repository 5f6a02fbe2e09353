// Compiled for the machine that builds it, so that rays are made and answers are stored in vectors.
#include "lab/bench/embree/embree_peer.h"

#include <tbb/parallel_for.h>

namespace mray::bench {
namespace {

template <class RayRecord>
void set_origin(RayRecord& record, vec3 org) {
    for (std::size_t i = 0; i < kPacketSize; ++i)
        embree::set_ray(record, i, {org, 0, {0, 0, 1}, 0});
}

constexpr int kAllRays[kPacketSize] = {-1, -1, -1, -1, -1, -1, -1, -1,
                                       -1, -1, -1, -1, -1, -1, -1, -1};

void trace_camera(RTCScene scene, const ImageParams& params, const cpu::Tile& tile, Frame& frame) {
    embree::Query query(embree::Coherence::kCoherent);
    RTCRayHit16 record;
    set_origin(record.ray, params.camera.org);
    for (std::uint32_t y0 = tile.y0; y0 < tile.y1; y0 += kBlockSize) {
        for (std::uint32_t x0 = tile.x0; x0 < tile.x1; x0 += kBlockSize) {
            make_camera_rays(params.camera, x0, y0, record.ray);
            for (std::size_t i = 0; i < kPacketSize; ++i) embree::clear_hit(record, i);
            query.trace(scene, record, kAllRays);
            for (std::uint32_t i = 0; i < kPacketSize; ++i) {
                const std::size_t pixel =
                    std::size_t{y0 + i / kBlockSize} * params.width + x0 + i % kBlockSize;
                frame.hits[pixel] = embree::hit_of(record, i);
            }
        }
    }
}

void trace_shadows(RTCScene scene, const cpu::PixelShader& shader, const cpu::PixelPart& part) {
    embree::Query query(embree::Coherence::kCoherent);
    cpu::SharedOriginRays rays[cpu::kSquareBlocks];
    cpu::LitPixels lit[cpu::kSquareBlocks];
    std::uint8_t occluded[cpu::kSquareRays] = {};
    if (shader.make_shadow_rays(part, rays, lit).rays > 0) {
        RTCRay16 record;
        set_origin(record, part.params.light);
        for (std::size_t block = 0; block < cpu::kSquareBlocks; ++block) {
            const cpu::SharedOriginRays& some = rays[block];
            int mask[kPacketSize];
            int any = 0;
            for (std::uint32_t i = 0; i < kPacketSize; ++i) any |= mask[i] = -int{some.has(i)};
            if (any == 0) continue;
            copy_shadow_rays(some, record);
            query.trace(scene, record, mask);
            for (std::size_t i = 0; i < kPacketSize; ++i)
                occluded[block * kPacketSize + i] = record.tfar[i] < 0 ? 1 : 0;
        }
    }
    shader.shade_shadows(part, occluded, lit);
}

}  // namespace

void trace_frame(const EmbreeScene& scene, const ImageParams& params, const cpu::ShadedMesh& mesh,
                 const cpu::PixelShader& shader, Frame& frame) {
    static_assert(kPacketSize == cpu::kBlockRays && kBlockSize * kBlockSize == kPacketSize);
    const cpu::ImageTiles squares(params.width, params.height, cpu::kSquareSide);
    tbb::parallel_for(std::uint32_t{0}, squares.count(), [&](std::uint32_t i) {
        const embree::FlushedDenormals flushed;
        const cpu::Tile tile = squares[i];
        trace_camera(scene.handle(), params, tile, frame);
        trace_shadows(scene.handle(), shader, {params, mesh, tile, frame});
    });
}

}  // namespace mray::bench
