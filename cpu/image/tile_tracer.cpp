#include "cpu/image/tile_tracer.h"

#include <algorithm>
#include <array>
#include <limits>

namespace mray::cpu {
namespace {

/// The most ambient-occlusion rays at a time, for the cache; one block may have more.
constexpr std::uint32_t kMostAoRays = 2048;

/// With fewer shadow rays than this for each leaf that the camera packet visited, triangles are so
/// small that light packets lose to rays one by one (lab/notes/cpu_tracer.md).
constexpr std::size_t kFewRaysOfLeaf = 7;

}  // namespace

const CameraPacket* ImageTracer::intersect_camera(const ImageParams& params, const Tile& tile,
                                                  Hit* hits, std::size_t stride,
                                                  const Watch& watch) const {
    // As many rays as a stream has.
    constexpr std::uint32_t kSide = 8;
    Ray rays[kSide * kSide];
    Hit answers[kSide * kSide];
    for (std::uint32_t y = tile.y0; y < tile.y1; y += kSide) {
        for (std::uint32_t x = tile.x0; x < tile.x1; x += kSide) {
            watch.throw_if_cancelled();
            const Tile block{x, y, std::min(x + kSide, tile.x1), std::min(y + kSide, tile.y1)};
            const std::uint32_t columns = (block.x1 - x + kBlockSide - 1) / kBlockSide;
            const std::uint32_t rows = (block.y1 - y + kBlockSide - 1) / kBlockSide;
            const std::size_t count = columns * rows * kBlockRays;
            shader_.make_camera_rays(params, block, rays);
            intersect(std::span(rays).first(count), std::span(answers).first(count));
            Hit* to = hits + (y - tile.y0) * stride + (x - tile.x0);
            for (std::uint32_t j = 0; j < block.y1 - y; ++j, to += stride) {
                for (std::uint32_t i = 0; i < block.x1 - x; ++i) {
                    const std::uint32_t from = j / kBlockSide * columns + i / kBlockSide;
                    to[i] =
                        answers[from * kBlockRays + i % kBlockSide * kBlockSide + j % kBlockSide];
                }
            }
        }
    }
    return nullptr;
}

void ImageTracer::occluded_among(vec3 org, std::span<const SharedOriginRays> rays,
                                 std::span<const std::uint16_t> indices,
                                 std::span<std::uint8_t> answers) const {
    std::vector<Ray> batch;
    batch.reserve(indices.size());
    for (const std::uint16_t i : indices)
        batch.push_back(rays[i / kBlockRays].ray(org, i % kBlockRays));
    std::vector<std::uint8_t> own(batch.size());
    occluded(batch, own);
    for (std::size_t i = 0; i < indices.size(); ++i) answers[indices[i]] = own[i];
}

void ImageTracer::occluded_shared_origin(vec3 org, std::span<const SharedOriginRays> rays,
                                         std::span<std::uint8_t> answers,
                                         const TileCounts& /*counts*/) const {
    std::fill(answers.begin(), answers.end(), std::uint8_t{1});
    std::vector<std::uint16_t> all(answers.size());
    all.resize(list_rays(rays.first(answers.size() / kBlockRays), all.data()));
    occluded_among(org, rays, all, answers);
}

std::size_t ImageTracer::trace_shadows(const ImageRegion& region) const {
    const Tile& tile = region.tile;
    const std::size_t count =
        light_packet_squares(tile.x1 - tile.x0, tile.y1 - tile.y0) * std::size_t{kSquareRays};
    ShadowRays& shadow = shadow_rays_.local();
    shadow.rays.resize(count / kBlockRays);
    shadow.lit.resize(count / kBlockRays);
    shadow.occluded.resize(count);
    // A smaller tile does not write all blocks.
    if (tile.x1 - tile.x0 < kCameraSide || tile.y1 - tile.y0 < kCameraSide)
        std::fill(shadow.rays.begin(), shadow.rays.end(), SharedOriginRays::none());
    const ShadowRayCounts counts =
        shader_.make_shadow_rays(region, shadow.rays.data(), shadow.lit.data());
    if (counts.rays != 0) {
        TileCounts known{counts.rays, 0};
        if (region.packet != nullptr) {
            known.camera_leaves = region.packet->leaf_count;
        } else if (!region.frame.has_hits) {
            // Without a packet, triangles are too small for packets.
            known.camera_leaves = std::numeric_limits<std::uint32_t>::max();
        }
        occluded_shared_origin(region.params.light, shadow.rays, shadow.occluded, known);
    } else {
        std::fill(shadow.occluded.begin(), shadow.occluded.end(), std::uint8_t{1});
    }
    shader_.shade_shadows(region, shadow.occluded.data(), shadow.lit.data());
    return counts.hits;
}

std::size_t ImageTracer::trace_ao(const ImageRegion& region, const Watch& watch) const {
    const Tile& tile = region.tile;
    const std::uint32_t blocks = std::max(kMostAoRays / (kBlockRays * region.params.ao_count), 1u);
    const std::uint32_t width = blocks * kBlockSide;
    std::vector<Ray> rays;
    std::vector<std::uint8_t> answers;
    std::size_t count = 0;
    for (std::uint32_t y = tile.y0; y < tile.y1; y += kBlockSide) {
        for (std::uint32_t x = tile.x0; x < tile.x1; x += width) {
            watch.throw_if_cancelled();
            const Tile run{x, y, std::min(x + width, tile.x1), std::min(y + kBlockSide, tile.y1)};
            // Without the packet: each run would have to find the normals of all its leaves.
            const ImageRegion pixels{region.params, region.mesh, run, region.frame};
            shader_.make_ao_rays(pixels, rays);
            answers.resize(rays.size());
            occluded(rays, answers);
            shader_.shade_ao(pixels, answers.data());
            count += rays.size();
        }
    }
    return count;
}

std::size_t ImageTracer::trace_tile(const ShadedMesh& mesh, const ImageParams& params,
                                    const Tile& tile, Frame& frame, const Watch& watch) const {
    ImageRegion region{params, mesh, tile, frame};
    if (!frame.has_hits) {
        Hit* const hits = &frame.hits[std::size_t{tile.y0} * params.width + tile.x0];
        region.packet = intersect_camera(params, tile, hits, params.width, watch);
        watch.throw_if_cancelled();
    }
    if (params.rays == kRaysShadow) return trace_shadows(region);
    if (params.rays == kRaysAo) return trace_ao(region, watch);
    shader_.shade_camera(region);
    return 0;
}

const CameraPacket* TileTracer::intersect_camera(const ImageParams& params, const Tile& tile,
                                                 Hit* hits, std::size_t stride,
                                                 const Watch& watch) const {
    CameraPacket& packet = scratch().camera;
    if (packets_.intersect_camera(params, tile, packet, hits, stride)) return &packet;
    return ImageTracer::intersect_camera(params, tile, hits, stride, watch);
}

void TileTracer::occluded_shared_origin(vec3 org, std::span<const SharedOriginRays> rays,
                                        std::span<std::uint8_t> answers,
                                        const TileCounts& counts) const {
    if (packets_.use() == PacketUse::kWhereItPays &&
        counts.camera_leaves * kFewRaysOfLeaf > counts.rays)
        return ImageTracer::occluded_shared_origin(org, rays, answers, counts);
    std::array<std::uint16_t, kLightPacketRays> fallback;
    const std::size_t count = packets_.occluded_shared_origin(org, rays, scratch().light,
                                                              answers.data(), fallback.data());
    if (count != 0) occluded_among(org, rays, std::span(fallback).first(count), answers);
}

}  // namespace mray::cpu
