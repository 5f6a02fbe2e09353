// A light packet: up to 64 x 64 rays that start at one point, such as shadow rays from a light, and
// which of them are occluded. Plain data without SIMD types.
//
//             rays      consists of    serves
//   block     4 x 4                    tests of a triangle against a block's rays
//   quad      8 x 8     2 x 2 blocks   the boxes of nodes: the active rays are a set of quads
//   group     16 x 16   2 x 2 quads    leaves: bounds of sixteen blocks, as many as vectors have
//   lanes square    32 x 32   2 x 2 groups   tiles of fewer rays, which have one or two squares
//   packet    64 x 64   2 x 2 squares
#pragma once

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>

#include "common/interop/ray.h"
#include "cpu/packet/packet_frame.h"

namespace mray::cpu {

/// Blocks are stored in Morton order. As many blocks again may hold regrouped rays.
inline constexpr std::uint32_t kQuadBlocks = 4;
inline constexpr std::uint32_t kGroupBlocks = 16;
inline constexpr std::uint32_t kSquareSide = 32;
inline constexpr std::uint32_t kSquareRays = kSquareSide * kSquareSide;
inline constexpr std::uint32_t kSquareBlocks = kSquareRays / kBlockRays;
inline constexpr std::uint32_t kLightPacketSide = 2 * kSquareSide;
inline constexpr std::uint32_t kLightPacketRays = kLightPacketSide * kLightPacketSide;
inline constexpr std::uint32_t kLightPacketBlocks = kLightPacketRays / kBlockRays;
inline constexpr std::uint32_t kAllLightPacketBlocks = 2 * kLightPacketBlocks;
inline constexpr std::uint32_t kAllLightPacketRays = kAllLightPacketBlocks * kBlockRays;
inline constexpr std::uint32_t kLightPacketGroups = kAllLightPacketBlocks / kGroupBlocks;
inline constexpr std::uint32_t kLightPacketQuads = kAllLightPacketBlocks / kQuadBlocks;
static_assert(kLightPacketQuads == 128);

/// The parts of a ray's index that come from x and from y: blocks in Morton order, the rays of a
/// block column by column.
struct LightRayIndices {
    std::uint16_t x[kLightPacketSide]{}, y[kLightPacketSide]{};

    constexpr LightRayIndices() {
        for (std::uint32_t i = 0; i < kLightPacketSide; ++i) {
            std::uint32_t blocks = 0;
            for (std::uint32_t bit = 0; kBlockSide << bit < kLightPacketSide; ++bit)
                blocks |= (i / kBlockSide >> bit & 1) << 2 * bit;
            x[i] = static_cast<std::uint16_t>(blocks * kBlockRays + i % kBlockSide * kBlockSide);
            y[i] = static_cast<std::uint16_t>(2 * blocks * kBlockRays + i % kBlockSide);
        }
    }
};
inline constexpr LightRayIndices kLightRayIndices;

inline std::uint32_t light_packet_ray(std::uint32_t x, std::uint32_t y) {
    return std::uint32_t{kLightRayIndices.x[x]} + kLightRayIndices.y[y];
}

/// Returns how many squares the rays of width x height pixels need.
inline std::uint32_t light_packet_squares(std::uint32_t width, std::uint32_t height) {
    return (height > kSquareSide ? 2 : 0) + (width > kSquareSide ? 2 : 1);
}

/// The rays of a block, which start at one point: dir[axis][i] and tfar[i] belong to ray i, as
/// in Ray; tnear is 0. Ray i is absent where tfar[i] < 0.
struct alignas(64) SharedOriginRays {
    float dir[3][kBlockRays], tfar[kBlockRays];

    static SharedOriginRays none() {
        SharedOriginRays rays{};
        std::fill_n(rays.tfar, kBlockRays, -1.0f);
        return rays;
    }

    bool has(std::size_t i) const { return tfar[i] >= 0; }
    /// How many rays there are. Compilers make vectors of bits, but not of has().
    std::size_t count() const {
        std::uint32_t found = 0;
        for (const float end : tfar) {
            const auto bits = std::bit_cast<std::uint32_t>(end);
            found += (bits <= 0x7F800000u ? 1u : 0u) | (bits == 0x80000000u ? 1u : 0u);
        }
        return found;
    }
    vec3 direction(std::size_t i) const { return {dir[0][i], dir[1][i], dir[2][i]}; }
    Ray ray(vec3 org, std::size_t i) const { return {org, 0, direction(i), tfar[i]}; }

    void set(std::size_t i, const Ray& ray) {
        for (int axis = 0; axis < 3; ++axis) dir[axis][i] = ray.dir[axis];
        tfar[i] = ray.tfar;
    }
};

/// Writes the indices of the rays that there are, in ascending order, to `indices`, which has room
/// for all. Returns their number.
inline std::size_t list_rays(std::span<const SharedOriginRays> blocks, std::uint16_t* indices) {
    std::size_t count = 0;
    for (std::size_t b = 0; b < blocks.size(); ++b) {
        if (blocks[b].count() == 0) continue;
        for (std::size_t i = 0; i < kBlockRays; ++i) {
            if (blocks[b].has(i)) indices[count++] = static_cast<std::uint16_t>(b * kBlockRays + i);
        }
    }
    return count;
}

/// Stands for the index of a ray: there is none.
inline constexpr std::uint16_t kNoRay = 0xFFFF;

struct alignas(kPage) LightPacket {
    PacketFrame frame;
    /// The caller's rays, a block each.
    const SharedOriginRays* rays;
    /// By ray, the rays of the regrouped blocks behind the others. x and y are the ray's place in
    /// the plane. A hit with 1/z less than q_lower does not concern the ray; kDone: it is occluded
    /// or absent.
    alignas(64) float x[kAllLightPacketRays];
    float y[kAllLightPacketRays], q_lower[kAllLightPacketRays];
    /// The least q_lower of each block.
    float block_q[kAllLightPacketBlocks];
    /// The bounds of the active rays of each block; empty (lower > upper) without any.
    PlaneRectangles<kAllLightPacketBlocks> blocks;
    /// Bounds of the active rays of each quad, and the least q_lower in it.
    PlaneRectangles<kLightPacketQuads> quads;
    float quad_q[kLightPacketQuads];
    PlaneRectangles<kLightPacketGroups> groups;
    std::uint32_t square_count;
    /// The number of regrouped blocks, which are kLightPacketBlocks and those after it.
    std::uint32_t regrouped_count;
    /// The rays of the regrouped blocks, and the caller's index of each, or kNoRay.
    SharedOriginRays regrouped[kLightPacketBlocks];
    std::uint16_t regrouped_ray[kLightPacketRays];
};

}  // namespace mray::cpu
