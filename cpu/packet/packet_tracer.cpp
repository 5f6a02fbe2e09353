#include "cpu/packet/packet_tracer.h"

#include <algorithm>
#include <cstring>
#include <vector>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "cpu/packet/packet_tracer.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "cpu/packet/camera_packet-inl.h"
#include "cpu/packet/camera_rays-inl.h"
#include "cpu/packet/light_trace-inl.h"

HWY_BEFORE_NAMESPACE();
namespace mray::cpu::HWY_NAMESPACE {

void write_misses(const Tile& tile, Hit* hits, std::size_t stride) {
    const std::size_t width = tile.x1 - tile.x0;
    Hit row[kCameraSide];
    std::fill_n(row, kCameraSide, no_hit());
    for (std::uint32_t y = tile.y0; y < tile.y1; ++y, hits += stride) {
        if (HWY_LIKELY(width == kCameraSide)) {
            std::memcpy(hits, row, sizeof row);
        } else {
            std::copy_n(row, width, hits);
        }
    }
}

void write_hits(const CameraPacket& packet, const Tile& tile, Hit* hits, std::size_t stride) {
    const std::uint32_t width = tile.x1 - tile.x0;
    const std::uint32_t height = tile.y1 - tile.y0;
    if (width % kBlockSide == 0 && height % kBlockSide == 0) {
        CameraPacketFinish(packet, hits, stride).run();
        return;
    }
    const std::size_t columns = packet.frame.grid_columns * kBlockSide;
    std::vector<Hit> blocks(columns * packet.frame.grid_rows * kBlockSide);
    CameraPacketFinish(packet, blocks.data(), columns).run();
    for (std::uint32_t y = 0; y < height; ++y)
        std::copy_n(&blocks[y * columns], width, hits + y * stride);
}

/// Traces a packet whose frame is set. Returns false if it is given up.
bool trace_camera_packet(const Bvh& bvh, PacketUse use, const Tile& tile, CameraPacket& packet,
                         Hit* hits, std::size_t stride) {
    CameraPacketTracer tracer(packet, use);
    PacketTraversal<CameraPacketTracer> traversal(bvh, tracer);
    if (!traversal.start(tracer.all())) {
        write_misses(tile, hits, stride);
        return true;
    }
    start_rays(tile.x1 - tile.x0, tile.y1 - tile.y0, packet);
    if (!traversal.run()) return false;
    tracer.finish();
    packet.hit_leaves.empty() ? write_misses(tile, hits, stride)
                              : write_hits(packet, tile, hits, stride);
    return true;
}

bool intersect_camera_packet(const Bvh& bvh, PacketUse use, const ImageParams& params,
                             const Tile& tile, CameraPacket& packet, Hit* hits,
                             std::size_t stride) {
    return frame_camera_packet(params, tile, packet) &&
           trace_camera_packet(bvh, use, tile, packet, hits, stride);
}

bool intersect_stored_packet(const Bvh& bvh, PacketUse use, const StoredRayTile& rays,
                             StoredDirections& directions, CameraPacket& packet, Hit* hits) {
    // A vector of one lane cannot hold the two halves of a ray.
    return kLanes > 1 && frame_stored_packet(rays, directions, packet) &&
           trace_camera_packet(bvh, use, {0, 0, rays.width, rays.height}, packet, hits,
                               kCameraSide);
}

/// Writes which rays of a block in place are occluded or absent.
HWY_INLINE void write_block(const LightPacket& packet, std::uint32_t block,
                            std::uint8_t* occluded) {
    const hn::Rebind<std::uint8_t, FloatTag> bytes;
    for (std::size_t l = 0; l < kBlockRays; l += kLanes) {
        const std::size_t r = block * kBlockRays + l;
        const Mask done = load(packet.q_lower + r) == splat(kDone);
        const auto answers = hn::IfThenElseZero(hn::RebindMask(kInts, done), splat(1));
        hn::StoreU(hn::DemoteTo(bytes, answers), bytes, occluded + r);
    }
}

HWY_INLINE void write_regrouped_block(const LightPacket& packet, std::uint32_t block,
                                      std::uint8_t* occluded) {
    for (std::uint32_t r = block * kBlockRays; r < (block + 1) * kBlockRays; ++r) {
        const std::uint16_t ray = packet.regrouped_ray[r - kLightPacketRays];
        if (ray != kNoRay) occluded[ray] = packet.q_lower[r] == kDone;
    }
}

/// Writes the indices of the rays of blocks that were not traced. Returns their number.
std::size_t write_fallback(const LightPacket& packet, const LightPacketBlocks& blocks,
                           std::uint16_t* fallback) {
    std::size_t count = 0;
    for_each_block(blocks, [&](std::uint32_t block) {
        for (std::uint32_t r = block * kBlockRays; r < (block + 1) * kBlockRays; ++r) {
            const std::uint32_t ray =
                r < kLightPacketRays ? r : packet.regrouped_ray[r - kLightPacketRays];
            if (ray != kNoRay && packet.rays[ray / kBlockRays].has(ray % kBlockRays))
                fallback[count++] = static_cast<std::uint16_t>(ray);
        }
    });
    return count;
}

/// Fewer rays of a face than this are fallback rays (lab/notes/cpu_tracer.md).
constexpr std::size_t kFewFaceRays = 64;

HWY_NOINLINE std::size_t occluded_by_faces(const Bvh& bvh, vec3 org, const SharedOriginRays* rays,
                                           std::uint32_t squares, LightPacket& packet,
                                           std::uint8_t* occluded, std::uint16_t* fallback) {
    std::fill_n(occluded, squares * kSquareRays, std::uint8_t{1});
    FaceOrder order;
    sort_by_face(rays, squares, order);
    std::size_t count = 0;
    for (std::uint32_t face = 0; face < kFaces; ++face) {
        const std::span<const std::uint16_t> own =
            order.of_keys(face * Cells::kCount, (face + 1) * Cells::kCount);
        if (own.size() < kFewFaceRays || !make_face_packet(org, rays, face, own, packet)) {
            std::copy(own.begin(), own.end(), fallback + count);
            count += own.size();
            continue;
        }
        trace_light_packet(bvh, packet);
        for (std::uint32_t i = 0; i < packet.regrouped_count; ++i)
            write_regrouped_block(packet, kLightPacketBlocks + i, occluded);
    }
    return count;
}

std::size_t occluded_light_packet(const Bvh& bvh, PacketUse use, vec3 org,
                                  std::span<const SharedOriginRays> rays, LightPacket& packet,
                                  std::uint8_t* occluded, std::uint16_t* fallback) {
    const auto squares = static_cast<std::uint32_t>(rays.size() / kSquareBlocks);
    LightPacketBlocks not_traced = {};
    if (!make_light_packet(org, rays.data(), squares, packet, not_traced))
        return occluded_by_faces(bvh, org, rays.data(), squares, packet, occluded, fallback);
    if (use == PacketUse::kWhereItPays && quads_overlap(packet)) {
        std::fill_n(occluded, squares * kSquareRays, std::uint8_t{1});
        return list_rays(rays.first(squares * kSquareBlocks), fallback);
    }
    trace_light_packet(bvh, packet);
    // Regrouped rays are written here as well, and again below.
    for (std::uint32_t block = 0; block < squares * kSquareBlocks; ++block)
        write_block(packet, block, occluded);
    for (std::uint32_t block = kLightPacketBlocks;
         block < kLightPacketBlocks + packet.regrouped_count; ++block) {
        if (!has_block(not_traced, block)) write_regrouped_block(packet, block, occluded);
    }
    return write_fallback(packet, not_traced, fallback);
}

}  // namespace mray::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE

#include "common/simd/simd_dispatch-inl.h"

namespace mray::cpu {

HWY_EXPORT(intersect_camera_packet);
HWY_EXPORT(intersect_stored_packet);
HWY_EXPORT(occluded_light_packet);

PacketTracer::PacketTracer(const Bvh& bvh, SimdTarget target, PacketUse use)
    : bvh_(&bvh),
      use_(use),
      intersect_(SIMD_FUNCTION(intersect_camera_packet, target)),
      intersect_stored_(SIMD_FUNCTION(intersect_stored_packet, target)),
      occluded_(SIMD_FUNCTION(occluded_light_packet, target)) {}

}  // namespace mray::cpu

#endif  // HWY_ONCE
