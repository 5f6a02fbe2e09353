#include "cpu/packet_tracer.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "cpu/packet_tracer.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "cpu/packet_tracer-inl.h"
// after: they use its types
#include "cpu/packet_finish-inl.h"
#include "cpu/packet_maker-inl.h"

HWY_BEFORE_NAMESPACE();
namespace morphray::cpu {
namespace HWY_NAMESPACE {

void intersect_camera_packet(const Bvh& bvh, const ImageParams& params, const Tile& tile,
                             Packet& packet, Hit* hits, std::size_t stride) {
    make_camera_packet(params, tile, packet);
    PacketTraversal<Query::kClosest>(bvh, packet).run();
    const std::uint32_t width = tile.x1 - tile.x0;
    const std::uint32_t height = tile.y1 - tile.y0;
    for (std::uint32_t block = 0; block < kPacketBlocks; ++block) {
        const std::uint32_t x0 = block % kBlocksPerSide * kBlockSide;
        const std::uint32_t y0 = block / kBlocksPerSide * kBlockSide;
        if (x0 >= width || y0 >= height) continue;
        Hit block_hits[kBlockRays];
        for (std::size_t l = 0; l < kBlockRays; l += hn::Lanes(Floats())) {
            finish_rays(packet, block * kBlockRays + l, block_hits + l);
        }
        const std::uint32_t columns = std::min(kBlockSide, width - x0);
        for (std::uint32_t y = 0; y < std::min(kBlockSide, height - y0); ++y) {
            std::memcpy(hits + (y0 + y) * stride + x0, block_hits + y * kBlockSide,
                        columns * sizeof(Hit));
        }
    }
}

bool occluded_point_packet(const Bvh& bvh, vec3 org, const Ray* rays, const std::uint8_t* active,
                           Packet& packet, std::uint8_t* occluded) {
    if (!make_point_packet(org, rays, active, packet)) return false;
    PacketTraversal<Query::kAny>(bvh, packet).run();
    for (std::uint32_t i = 0; i < kPacketRays; ++i) {
        if (active[i] != 0) occluded[i] = packet.q_lower[i] == kDone;
    }
    return true;
}

}  // namespace HWY_NAMESPACE
}  // namespace morphray::cpu
HWY_AFTER_NAMESPACE();

#if HWY_ONCE

#include "cpu/simd_dispatch-inl.h"

namespace morphray::cpu {
namespace {

HWY_EXPORT(intersect_camera_packet);
HWY_EXPORT(occluded_point_packet);

}  // namespace

PacketTracer::PacketTracer(const Bvh& bvh, SimdTarget target)
    : bvh_(&bvh),
      camera_(SIMD_FUNCTION(intersect_camera_packet, target)),
      point_(SIMD_FUNCTION(occluded_point_packet, target)) {}

void PacketTracer::intersect_camera(const ImageParams& params, const Tile& tile, Packet& packet,
                                    Hit* hits, std::size_t stride) const {
    camera_(*bvh_, params, tile, packet, hits, stride);
}

bool PacketTracer::occluded_from_point(vec3 org, const Ray* rays, const std::uint8_t* active,
                                       Packet& packet, std::uint8_t* occluded) const {
    return point_(*bvh_, org, rays, active, packet, occluded);
}

}  // namespace morphray::cpu

#endif  // HWY_ONCE
