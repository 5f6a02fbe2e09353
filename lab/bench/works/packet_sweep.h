// Tracers with packets and batches of every size, which show from which size on packets are faster.
#pragma once

#include <cstdint>
#include <vector>

#include "cpu/packet/camera/camera_packet.h"
#include "cpu/packet/light/light_packet.h"
#include "lab/bench/works/ours.h"

namespace mray::bench {

/// In pixels.
struct PacketShape {
    std::uint32_t width;
    std::uint32_t height;
};

/// The shapes of packets. Each divides a tile, or, if it is larger than a tile, a square of tiles.
inline constexpr PacketShape kPacketShapes[] = {{1, 1},   {2, 2},   {4, 4},   {8, 8},   {16, 16},
                                                {32, 32}, {64, 64}, {16, 8},  {8, 16},  {32, 4},
                                                {4, 32},  {32, 16}, {16, 32}, {64, 32}, {32, 64}};

/// Numbers of incoherent rays in a call of the single-ray tracer.
inline constexpr std::size_t kBatchSizes[] = {1, 2, 4, 8, 16, 32, 64, 128, 256, 512, 1024};

/// "packet WxH" for each shape, for primary and shadow rays. A packet of shadow rays consists of
/// the active rays of its pixels, traced with a mask, so its time includes the fixed cost of a
/// call.
std::vector<OurTracer> packets_of_each_shape(const Bvh& bvh, const SimdTarget& target);

/// "stream N" for each batch size, for ambient occlusion.
std::vector<OurTracer> batches_of_each_size(const Bvh& bvh, const SimdTarget& target);

}  // namespace mray::bench
