// The plane of a light packet: where its rays go through it, its frame, and the bounds of quads and
// groups.

#if defined(MORPHRAY_CPU_PACKET_LIGHT_LIGHT_PACKET_PLANE_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef MORPHRAY_CPU_PACKET_LIGHT_LIGHT_PACKET_PLANE_INL_H
#undef MORPHRAY_CPU_PACKET_LIGHT_LIGHT_PACKET_PLANE_INL_H
#else
#define MORPHRAY_CPU_PACKET_LIGHT_LIGHT_PACKET_PLANE_INL_H
#endif

#include <hwy/highway.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "cpu/packet/light/light_packet.h"
#include "cpu/packet/packet_frame-inl.h"
#include "cpu/packet/packet_node-inl.h"
#include "cpu/simd/hit_rule-inl.h"

HWY_BEFORE_NAMESPACE();
namespace mray::cpu {
namespace HWY_NAMESPACE {

/// The plane's unit is chosen so that |x| and |y| are at most this.
inline constexpr float kPlaneHalf = 0.5f * kLightPacketSide;

/// The least extent for which a unit is chosen: a packet of nearly parallel rays gets no tiny unit.
inline constexpr double kLeastPlaneExtent = 0x1p-16;

/// The unit for |x|, |y| up to `extent`, a power of two.
inline double plane_unit(double extent) {
    return std::exp2(std::ceil(std::log2(std::max(extent, kLeastPlaneExtent) / kPlaneHalf)));
}

/// Directions of some rays of a packet.
struct Samples {
    vec3 dirs[kLightPacketBlocks];
    std::size_t count = 0;
};

/// Takes the first ray of every step-th block, of blocks that have one.
HWY_INLINE void take_samples(const SharedOriginRays* rays, std::uint32_t squares,
                             std::uint32_t step, Samples& samples) {
    for (std::uint32_t block = 0; block < squares * kSquareBlocks; block += step) {
        for (std::uint32_t i = 0; i < kBlockRays; ++i) {
            if (!rays[block].has(i)) continue;
            samples.dirs[samples.count++] = rays[block].direction(i);
            break;
        }
    }
}

/// The plane across an axis of scene space that the rays of a packet go through, at z = 1. Its
/// origin is a point near all of them, and 1 in it is a power of two.
struct LightPlane {
    std::uint32_t axis = 0;
    /// The sign of the rays' components on the axis, 1 or -1.
    float sign = 1;
    /// The origin, on the next axis and the one after it.
    float origin[2] = {0, 0};
    float per_unit = 1;

    /// Sets h: the ray with the direction d goes through (h[0] / h[2], h[1] / h[2]), in units.
    HWY_INLINE void project(const FloatVec d[3], FloatVec h[3]) const {
        h[2] = d[axis] * splat(sign);
        for (std::uint32_t k = 0; k < 2; ++k) {
            const FloatVec beside = neg_mul_add(h[2], splat(origin[k]), d[(axis + 1 + k) % 3]);
            h[k] = beside * splat(per_unit);
        }
    }
};

/// The unit is chosen for the sampled extent times this, so that it is mostly the right one.
inline constexpr double kSampleMargin = 1.25;

/// Sets a plane across the axis that the samples follow most, with its origin in their mean.
/// Returns false if they have no mean.
HWY_INLINE bool choose_plane(const Samples& samples, LightPlane& plane) {
    double sum[3] = {0, 0, 0};
    for (std::size_t i = 0; i < samples.count; ++i) {
        for (int axis = 0; axis < 3; ++axis) sum[axis] += samples.dirs[i][axis];
    }
    for (std::uint32_t axis = 1; axis < 3; ++axis)
        if (std::abs(sum[axis]) > std::abs(sum[plane.axis])) plane.axis = axis;
    const double along = sum[plane.axis];
    if (!(std::abs(along) > 0)) return false;
    plane.sign = along < 0 ? -1.0f : 1.0f;
    double extent = 0;
    for (std::uint32_t k = 0; k < 2; ++k) {
        const auto axis = static_cast<int>((plane.axis + 1 + k) % 3);
        plane.origin[k] = static_cast<float>(sum[axis] / std::abs(along));
        for (std::size_t i = 0; i < samples.count; ++i) {
            const vec3 dir = samples.dirs[i];
            const double z = double{plane.sign} * dir[static_cast<int>(plane.axis)];
            if (z > 0) extent = std::max(extent, std::abs(dir[axis] / z - plane.origin[k]));
        }
    }
    plane.per_unit = static_cast<float>(1 / plane_unit(kSampleMargin * extent));
    return true;
}

/// The largest |x / z| or |y / z| of a packet from the plane's origin.
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
/// plane's unit. extent: the largest |x| or |y|.
///
/// 1. A fused difference, 1 / z and their product round once each: less than 4 u of the result.
/// 2. dot_error is relative to row_size and covers second orders and double (2^-40), or what a
///    product rounds without fused operations, over z > kLeastZ (2^-19): lab/proofs/packet_rays.g.
HWY_INLINE float place_error(const PacketFrame& frame, float extent) {
    const float dot_error = HWY_NATIVE_FMA ? 0x1p-40f : 0x1p-19f;
    return static_cast<float>(kWiden * 0x1p-22 * extent) +
           dot_error * (frame.row_size[0] + frame.row_size[1] + kPlaneHalf * frame.row_size[2]);
}

/// Sets the plane of a packet whose blocks are made for `plane`: frame with its wedges, and all
/// bounds in the final unit. Returns false if the rays spread too widely for it.
HWY_INLINE bool set_plane(vec3 org, const LightPlane& plane, LightPacket& packet) {
    const float extent = plane_extent(packet);
    double unit = 1.0 / plane.per_unit;
    if (extent * unit > kWidestPlane) return false;
    double scale = 1;
    if (extent > kPlaneHalf || extent < kPlaneHalf / 4) scale = plane_unit(extent * unit) / unit;
    unit *= scale;
    double axes[3][3] = {};
    axes[2][plane.axis] = plane.sign;
    for (std::uint32_t k = 0; k < 2; ++k) {
        const std::uint32_t axis = (plane.axis + 1 + k) % 3;
        axes[k][axis] = unit;
        axes[2][axis] = plane.origin[k];
    }
    set_frame(packet.frame, org, axes[0], axes[1], axes[2], kPlaneHalf + 1);
    packet.frame.ray_error = place_error(packet.frame, static_cast<float>(extent / scale));
    scale_plane(packet, static_cast<float>(1 / scale));
    set_wedges(packet.frame, axes[0], axes[1], axes[2]);
    return true;
}

}  // namespace HWY_NAMESPACE
}  // namespace mray::cpu
HWY_AFTER_NAMESPACE();

#endif
