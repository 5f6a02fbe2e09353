#include "cpu/image/tile_tracer.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

namespace mray::cpu {
namespace {

/// The most ambient-occlusion rays that are traced together, so that they stay in the cache; one
/// block may have more.
constexpr std::uint32_t kMostAoRays = 2048;

/// With fewer shadow rays than this for each leaf that the camera packet visited, triangles are so
/// small that light packets lose to rays one by one (lab/notes/cpu_tracer.md).
constexpr std::size_t kFewRaysOfLeaf = 7;

void trace_shadows(const TileTracer& tracer, const PixelPart& part, std::uint32_t camera_leaves) {
    const Tile& tile = part.tile;
    const std::size_t count =
        light_packet_squares(tile.x1 - tile.x0, tile.y1 - tile.y0) * std::size_t{kSquareRays};
    ShadowRays& shadow = tracer.shadow_rays();
    shadow.rays.assign(count / kBlockRays, SharedOriginRays::none());
    shadow.lit.resize(count / kBlockRays);
    shadow.occluded.assign(count, 1);
    const std::size_t ray_count =
        tracer.shader().make_shadow_rays(part, shadow.rays.data(), shadow.lit.data());
    if (ray_count != 0)
        tracer.occluded_shared_origin(part.params.light, shadow.rays, shadow.occluded,
                                      {ray_count, camera_leaves});
    tracer.shader().shade_shadows(part, shadow.occluded.data(), shadow.lit.data());
}

void trace_ao(const TileTracer& tracer, const PixelPart& part, const Watch& watch) {
    const Tile& tile = part.tile;
    const std::uint32_t blocks = std::max(kMostAoRays / (kBlockRays * part.params.ao_count), 1u);
    const std::uint32_t width = blocks * kBlockSide;
    std::vector<Ray> rays;
    std::vector<std::uint8_t> occluded;
    for (std::uint32_t y = tile.y0; y < tile.y1; y += kBlockSide) {
        for (std::uint32_t x = tile.x0; x < tile.x1; x += width) {
            watch.throw_if_cancelled();
            const Tile run{x, y, std::min(x + width, tile.x1), std::min(y + kBlockSide, tile.y1)};
            const PixelPart pixels{part.params, part.mesh, run, part.frame};
            tracer.shader().make_ao_rays(pixels, rays);
            occluded.resize(rays.size());
            tracer.occluded(rays, occluded);
            tracer.shader().shade_ao(pixels, occluded.data());
        }
    }
}

}  // namespace

std::uint32_t TileTracer::intersect_camera(const ImageParams& params, const Tile& tile, Hit* hits,
                                           std::size_t stride) const {
    CameraPacket& packet = scratch().camera;
    if (packets_.intersect_camera(params, tile, packet, hits, stride)) return packet.leaf_count;
    intersect_streams(params, tile, hits, stride);
    return std::numeric_limits<std::uint32_t>::max();
}

void TileTracer::intersect_streams(const ImageParams& params, const Tile& tile, Hit* hits,
                                   std::size_t stride) const {
    // As many rays as a stream has.
    constexpr std::uint32_t kSide = 8;
    Ray rays[kSide * kSide];
    Hit answers[kSide * kSide];
    for (std::uint32_t y = tile.y0; y < tile.y1; y += kSide) {
        for (std::uint32_t x = tile.x0; x < tile.x1; x += kSide) {
            const Tile part{x, y, std::min(x + kSide, tile.x1), std::min(y + kSide, tile.y1)};
            const std::uint32_t columns = (part.x1 - x + kBlockSide - 1) / kBlockSide;
            const std::uint32_t rows = (part.y1 - y + kBlockSide - 1) / kBlockSide;
            const std::size_t count = columns * rows * kBlockRays;
            shader_.make_camera_rays(params, part, rays);
            single_rays_.intersect(std::span(rays).first(count), std::span(answers).first(count));
            Hit* to = hits + (y - tile.y0) * stride + (x - tile.x0);
            for (std::uint32_t j = 0; j < part.y1 - y; ++j, to += stride) {
                for (std::uint32_t i = 0; i < part.x1 - x; ++i) {
                    const std::uint32_t block = j / kBlockSide * columns + i / kBlockSide;
                    to[i] =
                        answers[block * kBlockRays + i % kBlockSide * kBlockSide + j % kBlockSide];
                }
            }
        }
    }
}

void TileTracer::occluded_shared_origin(vec3 org, std::span<const SharedOriginRays> rays,
                                        std::span<std::uint8_t> occluded,
                                        const TileCounts& counts) const {
    if (packets_.use() == PacketUse::kWhereItPays &&
        counts.camera_leaves * kFewRaysOfLeaf > counts.rays)
        return BatchTiles(single_rays_).occluded_shared_origin(org, rays, occluded);
    std::array<std::uint16_t, kLightPacketRays> fallback;
    const std::size_t count = packets_.occluded_shared_origin(org, rays, scratch().light,
                                                              occluded.data(), fallback.data());
    if (count != 0)
        occluded_among(single_rays_, org, rays, std::span(fallback).first(count), occluded);
}

void trace_tile(const TileTracer& tracer, const ShadedMesh& mesh, const ImageParams& params,
                const Tile& tile, Frame& frame, const Watch& watch) {
    const std::uint32_t camera_leaves = tracer.intersect_camera(
        params, tile, &frame.hits[std::size_t{tile.y0} * params.width + tile.x0], params.width);
    watch.throw_if_cancelled();
    const PixelPart part{params, mesh, tile, frame};
    if (params.rays == kRaysShadow) {
        trace_shadows(tracer, part, camera_leaves);
    } else if (params.rays == kRaysAo) {
        trace_ao(tracer, part, watch);
    } else {
        tracer.shader().shade_camera(part);
    }
}

}  // namespace mray::cpu
