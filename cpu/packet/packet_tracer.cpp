#include "cpu/packet/packet_tracer.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "cpu/packet/packet_tracer.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <algorithm>
#include <cstring>
#include <vector>

#include "cpu/packet/camera_packet_finish-inl.h"
#include "cpu/packet/camera_packet_maker-inl.h"
#include "cpu/packet/light_packet_maker-inl.h"
#include "cpu/packet/light_packet_traversal-inl.h"
#include "cpu/packet/packet_tracer-inl.h"

HWY_BEFORE_NAMESPACE();
namespace morphray::cpu {
namespace HWY_NAMESPACE {

void write_misses(const Tile& tile, Hit* hits, std::size_t stride) {
    const std::size_t width = tile.x1 - tile.x0;
    const HitLanes misses = no_hits();
    alignas(64) Hit row[kCameraSide];
    for (std::size_t l = 0; l < kCameraSide; l += kLanes) {
        hn::StoreInterleaved4(misses.t, misses.u, misses.v, as_float(misses.prim_ids), kFloats,
                              &row[l].t);
    }
    for (std::uint32_t y = tile.y0; y < tile.y1; ++y, hits += stride) {
        if (HWY_LIKELY(width == kCameraSide)) {
            std::memcpy(hits, row, sizeof row);
        } else {
            std::copy_n(row, width, hits);
        }
    }
}

void write_hits(const Packet& packet, const Tile& tile, Hit* hits, std::size_t stride) {
    const std::uint32_t width = tile.x1 - tile.x0;
    const std::uint32_t height = tile.y1 - tile.y0;
    if (width % kBlockSide == 0 && height % kBlockSide == 0) {
        PacketFinish(packet, hits, stride).run();
        return;
    }
    const std::size_t columns = packet.frame.grid_columns * kBlockSide;
    std::vector<Hit> blocks(columns * packet.frame.grid_rows * kBlockSide);
    PacketFinish(packet, blocks.data(), columns).run();
    for (std::uint32_t y = 0; y < height; ++y)
        std::copy_n(&blocks[y * columns], width, hits + y * stride);
}

void intersect_camera_packet(const Bvh& bvh, const ImageParams& params, const Tile& tile,
                             Packet& packet, Hit* hits, std::size_t stride) {
    frame_camera_packet(params, tile, packet);
    PacketTraversal traversal(bvh, packet);
    if (!traversal.start()) return write_misses(tile, hits, stride);
    start_camera_rays(params, tile, packet);
    traversal.run();
    if (packet.hit_leaves.empty()) return write_misses(tile, hits, stride);
    write_hits(packet, tile, hits, stride);
}

/// Writes which rays of a block are occluded, or are none.
HWY_INLINE void write_block(const Packet& packet, std::uint32_t block, std::uint8_t* occluded) {
    const hn::Rebind<std::uint8_t, FloatTag> bytes;
    for (std::size_t l = 0; l < kBlockRays; l += kLanes) {
        const std::size_t r = block * kBlockRays + l;
        const Mask done = load(packet.q_lower + r) == splat(kDone);
        const auto answers = hn::IfThenElseZero(hn::RebindMask(kInts, done), splat(1));
        hn::StoreU(hn::DemoteTo(bytes, answers), bytes, occluded + r);
    }
}

/// Likewise of a block whose rays were put together anew.
HWY_INLINE void write_moved_block(const Packet& packet, std::uint32_t block,
                                  std::uint8_t* occluded) {
    for (std::uint32_t r = block * kBlockRays; r < (block + 1) * kBlockRays; ++r) {
        const std::uint16_t place = packet.place[r - kLightPacketRays];
        if (place != kNoPlace) occluded[place] = packet.q_lower[r] == kDone;
    }
}

/// Writes down the rays that there are in blocks of which nothing was asked; how many.
std::size_t write_left(const Packet& packet, const LightPacketBlocks& blocks, std::uint16_t* left) {
    std::size_t count = 0;
    for_each_block(blocks, [&](std::uint32_t block) {
        for (std::uint32_t r = block * kBlockRays; r < (block + 1) * kBlockRays; ++r) {
            const std::uint32_t place =
                r < kLightPacketRays ? r : packet.place[r - kLightPacketRays];
            if (place != kNoPlace && packet.rays[place / kBlockRays].has(place % kBlockRays))
                left[count++] = static_cast<std::uint16_t>(place);
        }
    });
    return count;
}

std::size_t occluded_light_packet(const Bvh& bvh, vec3 org, const SharedOriginRays* rays,
                                  std::uint32_t squares, Packet& packet, std::uint8_t* occluded,
                                  std::uint16_t* left) {
    LightPacketBlocks left_out = {};
    LightPacketBlocks moved = {};
    const std::uint32_t count = squares * kSquareRays;
    if (!make_light_packet(org, rays, squares, packet, left_out, moved)) {
        std::fill_n(occluded, count, std::uint8_t{1});
        packet.rays = rays;
        return write_left(packet, all_blocks(squares), left);
    }
    LightPacketTraversal(bvh, packet).run();
    // What this says of rays that are elsewhere is written again.
    for (std::uint32_t block = 0; block < squares * kSquareBlocks; ++block)
        write_block(packet, block, occluded);
    for (std::uint32_t block = kLightPacketBlocks; block < kLightPacketBlocks + packet.moved_count;
         ++block) {
        if (!has_block(left_out, block)) write_moved_block(packet, block, occluded);
    }
    return write_left(packet, left_out, left);
}

}  // namespace HWY_NAMESPACE
}  // namespace morphray::cpu
HWY_AFTER_NAMESPACE();

#if HWY_ONCE

#include "common/simd/simd_dispatch-inl.h"

namespace morphray::cpu {
namespace {

HWY_EXPORT(intersect_camera_packet);
HWY_EXPORT(occluded_light_packet);

}  // namespace

PacketTracer::PacketTracer(const Bvh& bvh, SimdTarget target)
    : bvh_(&bvh),
      camera_(SIMD_FUNCTION(intersect_camera_packet, target)),
      point_(SIMD_FUNCTION(occluded_light_packet, target)) {}

void PacketTracer::intersect_camera(const ImageParams& params, const Tile& tile, Packet& packet,
                                    Hit* hits, std::size_t stride) const {
    camera_(*bvh_, params, tile, packet, hits, stride);
}

std::size_t PacketTracer::occluded_shared_origin(vec3 org, std::span<const SharedOriginRays> rays,
                                                 Packet& packet, std::uint8_t* occluded,
                                                 std::uint16_t* left) const {
    const auto squares = static_cast<std::uint32_t>(rays.size() / kSquareBlocks);
    return point_(*bvh_, org, rays.data(), squares, packet, occluded, left);
}

}  // namespace morphray::cpu

#endif  // HWY_ONCE
