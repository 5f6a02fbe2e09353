// The plane of a light packet whose blocks are made: its unit, its frame, and the bounds of quads
// and groups.

#if defined(MORPHRAY_CPU_PACKET_LIGHT_LIGHT_PACKET_PLANE_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef MORPHRAY_CPU_PACKET_LIGHT_LIGHT_PACKET_PLANE_INL_H
#undef MORPHRAY_CPU_PACKET_LIGHT_LIGHT_PACKET_PLANE_INL_H
#else
#define MORPHRAY_CPU_PACKET_LIGHT_LIGHT_PACKET_PLANE_INL_H
#endif

#include <hwy/highway.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "cpu/packet/light/light_packet.h"
#include "cpu/packet/light/light_packet_directions-inl.h"
#include "cpu/packet/packet_frame-inl.h"
#include "cpu/packet/packet_node-inl.h"
#include "cpu/simd/hit_rule-inl.h"

HWY_BEFORE_NAMESPACE();
namespace mray::cpu {
namespace HWY_NAMESPACE {

/// The largest |x / z| or |y / z| of a packet. With s of NearDirections up to this, z is off by
/// 2^-19.1 of itself, and q by 2^-18 (kEndError) at most.
inline constexpr float kWidestPlane = 1.5f;

/// The number of groups that hold the regrouped blocks.
HWY_INLINE std::uint32_t regrouped_groups(const LightPacket& packet) {
    return (packet.regrouped_count + kGroupBlocks - 1) / kGroupBlocks;
}

/// Calls visit(first, end) for the blocks in place and for the regrouped blocks, in whole groups.
template <class Visit>
HWY_INLINE void for_each_range(const LightPacket& packet, Visit visit) {
    visit(0, packet.square_count * kSquareBlocks);
    const std::uint32_t groups = regrouped_groups(packet);
    if (groups != 0) visit(kLightPacketBlocks, kLightPacketBlocks + groups * kGroupBlocks);
}

/// The largest |x| or |y| of the active rays.
HWY_INLINE float plane_extent(const LightPacket& packet) {
    FloatVec extents = zero();
    for_each_range(packet, [&](std::uint32_t first, std::uint32_t end) HWY_ATTR {
        for (std::size_t b = first; b < end; b += kLanes) {
            const FloatVec lower =
                min(load(packet.block_lower_x + b), load(packet.block_lower_y + b));
            const FloatVec upper =
                max(load(packet.block_upper_x + b), load(packet.block_upper_y + b));
            extents = max(extents, max(-lower, upper));
        }
    });
    return most_lane(extents);
}

/// Scales the bounds of a group's blocks to the plane's unit, widens them by `margin`, and sets its
/// quads' bounds.
HWY_INLINE void scale_group(LightPacket& packet, std::uint32_t group, float scale, float margin) {
    const std::uint32_t first = group * kGroupBlocks;
    const auto scaled = [&](float* bound, float own_margin) HWY_ATTR {
        for (std::size_t l = 0; l < kGroupBlocks; l += kLanes) {
            const FloatVec v = mul_add(load(bound + first + l), splat(scale), splat(own_margin));
            store(v, bound + first + l);
        }
    };
    scaled(packet.block_lower_x, -margin);
    scaled(packet.block_upper_x, margin);
    scaled(packet.block_lower_y, -margin);
    scaled(packet.block_upper_y, margin);
    for (std::uint32_t k = first / kQuadBlocks; k < (first + kGroupBlocks) / kQuadBlocks; ++k) {
        const auto least = [k](const float* v) {
            v += kQuadBlocks * k;
            return std::min(std::min(v[0], v[1]), std::min(v[2], v[3]));
        };
        const auto most = [k](const float* v) {
            v += kQuadBlocks * k;
            return std::max(std::max(v[0], v[1]), std::max(v[2], v[3]));
        };
        packet.quad_lower_x[k] = least(packet.block_lower_x);
        packet.quad_upper_x[k] = most(packet.block_upper_x);
        packet.quad_lower_y[k] = least(packet.block_lower_y);
        packet.quad_upper_y[k] = most(packet.block_upper_y);
        packet.quad_q[k] = least(packet.block_q);
    }
    const auto of_quads = [first](const float* quads, auto combine) {
        quads += first / kQuadBlocks;
        return combine(combine(quads[0], quads[1]), combine(quads[2], quads[3]));
    };
    const auto lesser = [](float p, float q) { return std::min(p, q); };
    const auto greater = [](float p, float q) { return std::max(p, q); };
    packet.group_lower_x[group] = of_quads(packet.quad_lower_x, lesser);
    packet.group_upper_x[group] = of_quads(packet.quad_upper_x, greater);
    packet.group_lower_y[group] = of_quads(packet.quad_lower_y, lesser);
    packet.group_upper_y[group] = of_quads(packet.quad_upper_y, greater);
}

/// Scales the packet to the plane's unit, and sets the bounds of quads and frame. scale: a power of
/// two, so that nothing is rounded.
HWY_INLINE void scale_plane(LightPacket& packet, float scale) {
    PacketFrame& frame = packet.frame;
    // Absent squares are done.
    std::fill_n(packet.quad_q, kLightPacketQuads, kDone);
    FloatVec lower_x = splat(kEmptyLower), lower_y = lower_x;
    FloatVec upper_x = splat(kEmptyUpper), upper_y = upper_x;
    for_each_range(packet, [&](std::uint32_t first, std::uint32_t end) HWY_ATTR {
        for (std::size_t r = first * kBlockRays; scale != 1 && r < end * kBlockRays; r += kLanes) {
            store(load(packet.x + r) * splat(scale), packet.x + r);
            store(load(packet.y + r) * splat(scale), packet.y + r);
        }
        for (std::uint32_t group = first / kGroupBlocks; group < end / kGroupBlocks; ++group)
            scale_group(packet, group, scale, 2 * frame.ray_error);
        for (std::size_t b = first; b < end; b += kLanes) {
            const FloatVec lx = load(packet.block_lower_x + b);
            const FloatVec ux = load(packet.block_upper_x + b);
            const FloatVec ly = load(packet.block_lower_y + b);
            const FloatVec uy = load(packet.block_upper_y + b);
            lower_x = min(lower_x, lx);
            upper_x = max(upper_x, ux);
            lower_y = min(lower_y, ly);
            upper_y = max(upper_y, uy);
        }
    });
    frame.lower_x = least_lane(lower_x);
    frame.upper_x = most_lane(upper_x);
    frame.lower_y = least_lane(lower_y);
    frame.upper_y = most_lane(upper_y);
}

/// An upper bound of how far a ray's stored x or y is from that of its exact direction, in the
/// plane's unit. extent: the largest |x| or |y| before x and y are scaled by `scale`; unit: what 1
/// is there in x / z.
///
/// 1. NearDirections has an error of (kPlaceUnits + kPlaceUnitsOfExtent s) s u, with s = extent *
///    unit; in the plane's unit s is extent / scale.
/// 2. dot_error is relative to row_size and covers second orders of the fused form (2^-40), or the
///    roundings of products of magnitude up to 2 row_size over z > kLeastZ (2^-19) without fused
///    operations (lab/proofs/packet_rays.g).
HWY_INLINE float place_error(const PacketFrame& frame, float extent, double unit, double scale) {
    const double units = kPlaceUnits + kPlaceUnitsOfExtent * extent * unit;
    const double own_error = kWiden * 0x1p-24 * units * extent / scale;
    const float dot_error = HWY_NATIVE_FMA ? 0x1p-40f : 0x1p-19f;
    return static_cast<float>(own_error) +
           dot_error * (frame.row_size[0] + frame.row_size[1] + kPlaneHalf * frame.row_size[2]);
}

/// Sets the plane of a packet whose blocks are made for `unit`: frame with its wedges, and all
/// bounds in the final unit. Returns false if the rays spread too widely for it.
HWY_INLINE bool set_plane(vec3 org, double axes[3][3], double unit, LightPacket& packet) {
    const float extent = plane_extent(packet);
    if (extent * unit > kWidestPlane) return false;
    double scale = 1;
    if (extent > kPlaneHalf || extent < kPlaneHalf / 4) scale = plane_unit(extent * unit) / unit;
    for (int axis = 0; axis < 3; ++axis) {
        axes[0][axis] *= unit * scale;
        axes[1][axis] *= unit * scale;
    }
    set_frame(packet.frame, org, axes[0], axes[1], axes[2], kPlaneHalf + 1);
    packet.frame.ray_error = place_error(packet.frame, extent, unit, scale);
    scale_plane(packet, static_cast<float>(1 / scale));
    set_wedges(packet.frame, axes[0], axes[1], axes[2]);
    return true;
}

}  // namespace HWY_NAMESPACE
}  // namespace mray::cpu
HWY_AFTER_NAMESPACE();

#endif
