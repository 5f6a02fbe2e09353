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
#include "cpu/packet/light/light_packet_blocks-inl.h"
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

/// The plane across an axis of scene space that the rays of a packet go through, at z = 1.
struct LightPlane {
    std::uint32_t axis = 0;
    /// The sign of the rays' components on the axis, 1 or -1.
    float sign = 1;
    /// Where x and y are 0, on the next axis and the one after it: near all rays.
    float origin[2] = {0, 0};
    /// x and y by the distances from there on these two axes.
    float rows[2][2] = {{1, 0}, {0, 1}};
    /// What 1 is in x and y: a power of two, by which the rows are divided.
    double unit = 1;

    std::uint32_t beside(std::uint32_t k) const { return (axis + 1 + k) % 3; }

    void set_unit(double of_one) {
        for (auto& row : rows)
            for (float& v : row) v = static_cast<float>(v * (unit / of_one));
        unit = of_one;
    }

    /// Sets h: the ray with the direction d goes through (h[0] / h[2], h[1] / h[2]).
    HWY_INLINE void project(const FloatVec d[3], FloatVec h[3]) const {
        h[2] = d[axis] * splat(sign);
        const FloatVec from[2] = {neg_mul_add(h[2], splat(origin[0]), d[beside(0)]),
                                  neg_mul_add(h[2], splat(origin[1]), d[beside(1)])};
        for (int k = 0; k < 2; ++k)
            h[k] = mul_add(splat(rows[k][0]), from[0], splat(rows[k][1]) * from[1]);
    }
};

/// The unit is chosen for the sampled extent times this, so that it is mostly the right one.
inline constexpr double kSampleMargin = 1.25;

/// Sets a plane across the axis that the samples follow most, with its origin in their mean. There
/// x and y are those of a plane across the mean, which boxes and triangles do not look slanted in.
/// Returns false if the samples have no mean.
HWY_INLINE bool choose_plane(const Samples& samples, LightPlane& plane) {
    glm::dvec3 mean(0);
    for (std::size_t i = 0; i < samples.count; ++i) mean += glm::dvec3(samples.dirs[i]);
    const double length = glm::length(mean);
    if (!(length > 0)) return false;
    std::uint32_t least = 0;
    for (std::uint32_t axis = 0; axis < 3; ++axis) {
        mean[axis] /= length;
        if (std::abs(mean[axis]) > std::abs(mean[plane.axis])) plane.axis = axis;
        if (std::abs(mean[axis]) < std::abs(mean[least])) least = axis;
    }
    plane.sign = mean[plane.axis] < 0 ? -1.0f : 1.0f;
    const double along = std::abs(mean[plane.axis]);
    // Across the mean: one vector in the plane of the mean and the least axis, one across both.
    const double size = std::sqrt(1 - mean[least] * mean[least]);
    for (std::uint32_t i = 0; i < 2; ++i) {
        const std::uint32_t axis = plane.beside(i);
        const double part = (axis == least ? 1.0 : 0.0) - mean[axis] * mean[least];
        const double last = axis == least             ? 0.0
                            : axis == (least + 1) % 3 ? mean[(least + 2) % 3]
                                                      : -mean[(least + 1) % 3];
        plane.origin[i] = static_cast<float>(mean[axis] / along);
        plane.rows[0][i] = static_cast<float>(along * part / size);
        plane.rows[1][i] = static_cast<float>(along * last / size);
    }
    double extent = 0;
    for (std::size_t i = 0; i < samples.count; ++i) {
        const float* const dir = &samples.dirs[i].x;
        const double z = double{plane.sign} * dir[plane.axis];
        if (!(z > 0)) continue;
        const double from[2] = {dir[plane.beside(0)] / z - plane.origin[0],
                                dir[plane.beside(1)] / z - plane.origin[1]};
        for (const auto& row : plane.rows)
            extent = std::max(extent, std::abs(row[0] * from[0] + row[1] * from[1]));
    }
    plane.set_unit(plane_unit(kSampleMargin * extent));
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
            const RectangleLanes block(packet.blocks, b);
            extents = max(extents, max(-min(block.lower_x, block.lower_y),
                                       max(block.upper_x, block.upper_y)));
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
    scaled(packet.blocks.lower_x, -margin);
    scaled(packet.blocks.upper_x, margin);
    scaled(packet.blocks.lower_y, -margin);
    scaled(packet.blocks.upper_y, margin);
    static_assert(kQuadBlocks == 4 && kGroupBlocks == 4 * kQuadBlocks);
    for (std::uint32_t k = first / kQuadBlocks; k < (first + kGroupBlocks) / kQuadBlocks; ++k) {
        packet.quads.set(k, packet.blocks.around_four(kQuadBlocks * k));
        update_quad_depth(packet, k);
    }
    packet.groups.set(group, packet.quads.around_four(first / kQuadBlocks));
}

/// Scales the packet to the plane's unit, and sets the bounds of quads and frame. scale: a power of
/// two, so that nothing is rounded.
HWY_INLINE void scale_plane(LightPacket& packet, float scale) {
    PacketFrame& frame = packet.frame;
    // Absent squares are done.
    std::fill_n(packet.quad_q, kLightPacketQuads, kDone);
    RectangleLanes bounds(PlaneRectangle::none());
    for_each_range(packet, [&](std::uint32_t first, std::uint32_t end) HWY_ATTR {
        for (std::size_t r = first * kBlockRays; scale != 1 && r < end * kBlockRays; r += kLanes) {
            store(load(packet.x + r) * splat(scale), packet.x + r);
            store(load(packet.y + r) * splat(scale), packet.y + r);
        }
        for (std::uint32_t group = first / kGroupBlocks; group < end / kGroupBlocks; ++group)
            scale_group(packet, group, scale, 2 * frame.ray_error);
        for (std::size_t b = first; b < end; b += kLanes)
            bounds.add(RectangleLanes(packet.blocks, b));
    });
    frame.lower_x = least_lane(bounds.lower_x);
    frame.upper_x = most_lane(bounds.upper_x);
    frame.lower_y = least_lane(bounds.lower_y);
    frame.upper_y = most_lane(bounds.upper_y);
}

/// An upper bound of how far a ray's stored x or y is from that of its exact direction, in the
/// plane's unit. extent: the largest |x| or |y|.
///
/// 1. A fused difference, a product and a fused sum, 1 / z and the last product round once each: 5
/// u
///    of two terms whose magnitudes add up to at most 2.45 extent, which is less than 16 u of it.
/// 2. dot_error is relative to row_size and covers second orders and double (2^-40), or what a
///    product rounds without fused operations, over z > kLeastZ (2^-19): lab/proofs/packet_rays.g.
HWY_INLINE float place_error(const PacketFrame& frame, float extent) {
    const float dot_error = HWY_NATIVE_FMA ? 0x1p-40f : 0x1p-19f;
    return static_cast<float>(kWiden * 0x1p-20 * extent) +
           dot_error * (frame.row_size[0] + frame.row_size[1] + kPlaneHalf * frame.row_size[2]);
}

/// Sets the plane of a packet whose blocks are made for `plane`: frame with its wedges, and all
/// bounds in the final unit. Returns false if the rays spread too widely for it.
HWY_INLINE bool set_plane(vec3 org, LightPlane plane, LightPacket& packet) {
    const float extent = plane_extent(packet);
    if (extent * plane.unit > kWidestPlane) return false;
    double scale = 1;
    if (extent > kPlaneHalf || extent < kPlaneHalf / 4)
        scale = plane_unit(extent * plane.unit) / plane.unit;
    plane.set_unit(plane.unit * scale);
    const auto& rows = plane.rows;
    const double det = double{rows[0][0]} * rows[1][1] - double{rows[0][1]} * rows[1][0];
    PlaneAxes axes = {glm::dvec3(0), glm::dvec3(0), glm::dvec3(0)};
    axes.z[plane.axis] = plane.sign;
    for (std::uint32_t i = 0; i < 2; ++i) {
        const float sign = i == 0 ? 1.0f : -1.0f;
        axes.x[plane.beside(i)] = sign * rows[1][1 - i] / det;
        axes.y[plane.beside(i)] = -sign * rows[0][1 - i] / det;
        axes.z[plane.beside(i)] = plane.origin[i];
    }
    set_frame(packet.frame, org, axes, kPlaneHalf + 1);
    packet.frame.ray_error = place_error(packet.frame, static_cast<float>(extent / scale));
    scale_plane(packet, static_cast<float>(1 / scale));
    set_wedges(packet.frame, axes);
    return true;
}

}  // namespace HWY_NAMESPACE
}  // namespace mray::cpu
HWY_AFTER_NAMESPACE();

#endif
