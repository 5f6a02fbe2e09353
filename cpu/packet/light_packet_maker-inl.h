// Making packets of rays that start at one point and go anywhere, such as shadow rays from a light.

#if defined(MORPHRAY_CPU_PACKET_LIGHT_PACKET_MAKER_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef MORPHRAY_CPU_PACKET_LIGHT_PACKET_MAKER_INL_H
#undef MORPHRAY_CPU_PACKET_LIGHT_PACKET_MAKER_INL_H
#else
#define MORPHRAY_CPU_PACKET_LIGHT_PACKET_MAKER_INL_H
#endif

#include <hwy/cache_control.h>
#include <hwy/highway.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "cpu/packet/camera_packet_maker-inl.h"
#include "cpu/packet/light_packet_directions-inl.h"
#include "cpu/packet/light_packet_rays-inl.h"
#include "cpu/packet/light_packet_regroup-inl.h"
#include "cpu/packet/packet.h"
#include "cpu/simd/fast_hit_rule-inl.h"

HWY_BEFORE_NAMESPACE();
namespace morphray::cpu {
namespace HWY_NAMESPACE {

// Every how many blocks one ray says enough of where the packet goes.
constexpr std::uint32_t kSampledBlocks = 17;

// How far ahead of the rays that are made into a packet those are asked for that come next.
constexpr std::uint32_t kBlocksAhead = 24;

/// Asks for a block of rays. Behind the last one are those of the next packet, or nothing that
/// matters.
HWY_INLINE void prefetch_block(const SharedOriginRays* rays, std::uint32_t block) {
    const auto first = reinterpret_cast<std::uintptr_t>(rays) + block * sizeof(SharedOriginRays);
    for (std::size_t i = 0; i < sizeof(SharedOriginRays); i += 64)
        hwy::Prefetch(reinterpret_cast<const char*>(first + i));
}

/// Combines the lanes of each of kGroupBlocks vectors to one of kGroupBlocks floats. combine: Min
/// or Max of two vectors.
template <class Combine>
HWY_INLINE void reduce_lanes(const float* vectors, Combine combine, float* out) {
#if HWY_TARGET == HWY_SCALAR
    for (std::size_t k = 0; k < kGroupBlocks; ++k) out[k] = vectors[k];
    (void)combine;
#else
    const auto four = [&](std::size_t first) HWY_ATTR {
        FloatVec v[4];
        for (std::size_t k = 0; k < 4; ++k) v[k] = load(vectors + (first + k) * kLanes);
        return combine_four(v, combine);
    };
    const auto halves = [&](FloatVec a, FloatVec b) HWY_ATTR {
        return combine(hn::ConcatLowerLower(kFloats, b, a), hn::ConcatUpperUpper(kFloats, b, a));
    };
    if constexpr (kLanes == 16) {
        const FloatVec even = halves(four(0), four(8));
        const FloatVec odd = halves(four(4), four(12));
        store(combine(hn::OddEvenBlocks(odd, even),
                      hn::SwapAdjacentBlocks(hn::OddEvenBlocks(even, odd))),
              out);
    } else if constexpr (kLanes == 8) {
        store(halves(four(0), four(4)), out);
        store(halves(four(8), four(12)), out + 8);
    } else {
        for (std::size_t k = 0; k < kGroupBlocks; k += 4) store(four(k), out + k);
    }
#endif
}

// The largest |x / z| or |y / z| of a packet. With NearDirections' s up to here, z is off by
// 2^-19.1 of itself, and q by 2^-18 at most.
constexpr float kWidestPlane = 1.5f;

/// Bounds of blocks of rays while a group is made: of x and y from both sides, and 1 / z.
struct alignas(64) GroupBounds {
    float lower_x[kGroupBlocks * kLanes], upper_x[kGroupBlocks * kLanes];
    float lower_y[kGroupBlocks * kLanes], upper_y[kGroupBlocks * kLanes];
    float q[kGroupBlocks * kLanes];

    /// Of all blocks of a group.
    HWY_INLINE void store(std::uint32_t group, Packet& packet) const {
        const auto lesser = [](FloatVec a, FloatVec b) HWY_ATTR { return min(a, b); };
        const auto greater = [](FloatVec a, FloatVec b) HWY_ATTR { return max(a, b); };
        const std::uint32_t first = group * kGroupBlocks;
        reduce_lanes(lower_x, lesser, packet.block_lower_x + first);
        reduce_lanes(upper_x, greater, packet.block_upper_x + first);
        reduce_lanes(lower_y, lesser, packet.block_lower_y + first);
        reduce_lanes(upper_y, greater, packet.block_upper_y + first);
        reduce_lanes(q, lesser, packet.block_q + first);
    }
};

/// Makes the rays of one block of a packet whose plane has yet no unit.
HWY_INLINE void make_light_block(const SharedOriginRays& rays, const NearDirections& directions,
                                 std::uint32_t block, Packet& packet, GroupBounds& bounds,
                                 FloatVec& least_z) {
    const FloatVec far = splat(1e30f);
    FloatVec lower_x = far, lower_y = far, upper_x = -far, upper_y = upper_x;
    FloatVec least_q = splat(kDone);
    for (std::size_t l = 0; l < kBlockRays; l += kLanes) {
        const std::size_t r = block * kBlockRays + l;
        FloatVec d[3], tfar, h[3];
        load_rays(rays, l, d, tfar);
        const Mask on = tfar >= zero();
        directions.project(d, h);
        const FloatVec z = select(on, h[2], splat(1.0f));
        const FloatVec rz = splat(1.0f) / z;
        const FloatVec x = zero_unless(on, h[0] * rz);
        const FloatVec y = zero_unless(on, h[1] * rz);
        least_z = min(least_z, z);
        store(x, packet.x + r);
        store(y, packet.y + r);
        // Only what lies nearer than tfar matters.
        const FloatVec q = rz / select(on, tfar, splat(1.0f));
        const FloatVec q_lower = select(on, q * splat(1 - 0x1p-18f), splat(kDone));
        store(q_lower, packet.q_lower + r);
        least_q = min(least_q, q_lower);
        lower_x = min(lower_x, select(on, x, far));
        upper_x = max(upper_x, select(on, x, -far));
        lower_y = min(lower_y, select(on, y, far));
        upper_y = max(upper_y, select(on, y, -far));
    }
    const std::size_t own = block % kGroupBlocks * kLanes;
    store(lower_x, bounds.lower_x + own);
    store(upper_x, bounds.upper_x + own);
    store(lower_y, bounds.lower_y + own);
    store(upper_y, bounds.upper_y + own);
    store(least_q, bounds.q + own);
}

/// Puts the active rays of some blocks together anew, by where they go through the plane, and those
/// blocks out of use.
HWY_NOINLINE inline void regroup_blocks(const NearDirections& directions,
                                        const LightPacketBlocks& blocks, Packet& packet,
                                        FloatVec& least_z) {
    CellOrder order;
    sort_by_cell(packet, blocks, order);
    leave_out_blocks(packet, blocks);
    packet.moved_count = static_cast<std::uint32_t>((order.count + kBlockRays - 1) / kBlockRays);
    const std::uint32_t groups = (packet.moved_count + kGroupBlocks - 1) / kGroupBlocks;
    GroupBounds bounds;
    for (std::uint32_t i = 0; i < groups * kGroupBlocks; ++i) {
        SharedOriginRays own;
        for (std::uint32_t k = 0; k < kBlockRays; ++k) {
            const std::uint32_t at = i * kBlockRays + k;
            packet.place[at] = at < order.count ? order.rays[at] : kNoPlace;
        }
        gather_rays(packet, i * kBlockRays, own);
        make_light_block(own, directions, kLightPacketBlocks + i, packet, bounds, least_z);
        if (i % kGroupBlocks == kGroupBlocks - 1)
            bounds.store((kLightPacketBlocks + i) / kGroupBlocks, packet);
    }
}

/// The groups of blocks that were put together anew.
HWY_INLINE std::uint32_t moved_groups(const Packet& packet) {
    return (packet.moved_count + kGroupBlocks - 1) / kGroupBlocks;
}

/// Calls visit(first, end) for the blocks in place and for those that were put together anew, in
/// whole groups.
template <class Visit>
HWY_INLINE void for_each_range(const Packet& packet, Visit visit) {
    visit(0, packet.square_count * kSquareBlocks);
    const std::uint32_t moved = moved_groups(packet);
    if (moved != 0) visit(kLightPacketBlocks, kLightPacketBlocks + moved * kGroupBlocks);
}

/// The largest |x| or |y| of the active rays.
HWY_INLINE float plane_extent(const Packet& packet) {
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
    return hn::GetLane(hn::MaxOfLanes(kFloats, extents));
}

/// Gives a group of blocks the plane's unit, and finds its quads' bounds.
HWY_INLINE void scale_group(Packet& packet, std::uint32_t group, float scale, float margin) {
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
}

/// Gives the plane its unit, and the groups and the frame their bounds. scale: a power of two, so
/// that nothing is rounded.
HWY_INLINE void scale_plane(Packet& packet, float scale) {
    PacketFrame& frame = packet.frame;
    // Of squares that are not there.
    std::fill_n(packet.quad_q, kLightPacketQuads, kDone);
    FloatVec lower_x = splat(1e30f), lower_y = lower_x, upper_x = splat(-1e30f), upper_y = upper_x;
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
    frame.lower_x = hn::GetLane(hn::MinOfLanes(kFloats, lower_x));
    frame.upper_x = hn::GetLane(hn::MaxOfLanes(kFloats, upper_x));
    frame.lower_y = hn::GetLane(hn::MinOfLanes(kFloats, lower_y));
    frame.upper_y = hn::GetLane(hn::MaxOfLanes(kFloats, upper_y));
}

// Blocks with rays that spread more than this many times as far as those of the median block are
// put together anew, if there are a few; those that then still spread so much farther are left out.
constexpr float kWide = 1.6f;
constexpr float kTooWide = 12;
constexpr std::size_t kFewBlocks = 2;

/// Makes a packet of some squares of rays that start at one point. False if they spread too widely
/// to be seen from one plane, or there is none. left_out: the blocks of which nothing is asked
/// because their rays have too little in common; moved: those whose rays were put together anew.
/// Both are empty before.
bool make_light_packet(vec3 org, const SharedOriginRays* rays, std::uint32_t squares,
                       Packet& packet, LightPacketBlocks& left_out, LightPacketBlocks& moved) {
    double axes[3][3];
    float centre[3];
    Samples samples;
    // Waiting for more of them in memory takes a tenth of a packet's time.
    take_samples(rays, squares, kSampledBlocks, samples);
    if (samples.count == 0) take_samples(rays, squares, 1, samples);
    if (!choose_axes(samples, axes, centre)) return false;
    // Mostly the right unit, so that nothing need be scaled afterwards.
    const double unit = plane_unit(1.25 * sampled_extent(samples, axes));
    const NearDirections directions(axes, centre, 1 / unit);
    FloatVec least_z = splat(1e30f);
    GroupBounds bounds;
    packet.square_count = squares;
    packet.moved_count = 0;
    packet.rays = rays;
    for (std::uint32_t block = 0; block < squares * kSquareBlocks; ++block) {
        prefetch_block(rays, block + kBlocksAhead);
        make_light_block(rays[block], directions, block, packet, bounds, least_z);
        if (block % kGroupBlocks == kGroupBlocks - 1) bounds.store(block / kGroupBlocks, packet);
    }
    if (!(hn::GetLane(hn::MinOfLanes(kFloats, least_z)) > 0.25f)) return false;
    Spreads spreads;
    const std::uint32_t count = squares * kSquareBlocks;
    measure_spreads(packet, 0, count, spreads);
    if (spreads.used == 0) return false;
    const float median = median_of_blocks(spreads.of_block, count, spreads.used);
    const std::size_t wide = blocks_wider(spreads, 0, count, kWide * median, moved);
    if (wide >= kFewBlocks) {
        regroup_blocks(directions, moved, packet, least_z);
        const std::uint32_t end = kLightPacketBlocks + moved_groups(packet) * kGroupBlocks;
        measure_spreads(packet, kLightPacketBlocks, end, spreads);
        blocks_wider(spreads, kLightPacketBlocks, end, kTooWide * median, left_out);
        leave_out_blocks(packet, left_out);
    } else if (wide != 0) {
        moved = {};
        blocks_wider(spreads, 0, count, kTooWide * median, left_out);
        leave_out_blocks(packet, left_out);
    }
    const float extent = plane_extent(packet);
    if (extent * unit > kWidestPlane) return false;
    double scale = 1;
    if (extent > kPlaneHalf || extent < kPlaneHalf / 4) scale = plane_unit(extent * unit) / unit;
    for (int axis = 0; axis < 3; ++axis) {
        axes[0][axis] *= unit * scale;
        axes[1][axis] *= unit * scale;
    }
    PacketFrame& frame = packet.frame;
    set_frame(frame, org, axes[0], axes[1], axes[2], kPlaneHalf + 1);
    // Of x, y up to extent / scale as NearDirections derives it; without a fused multiply-add the
    // roundings of products of magnitude up to 2 row_size, over z > 1/4.
    const double units = 28 + 20 * extent * unit;
    const double own_error = 1.001 * 0x1p-24 * units * extent / scale;
    const float dot_error = HWY_NATIVE_FMA ? 0x1p-40f : 0x1p-19f;
    frame.ray_error =
        static_cast<float>(own_error) +
        dot_error * (frame.row_size[0] + frame.row_size[1] + kPlaneHalf * frame.row_size[2]);
    scale_plane(packet, static_cast<float>(1 / scale));
    return true;
}

}  // namespace HWY_NAMESPACE
}  // namespace morphray::cpu
HWY_AFTER_NAMESPACE();

#endif
