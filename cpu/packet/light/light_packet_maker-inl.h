// Making light packets from rays that start at one point and have any directions.

#if defined(MORPHRAY_CPU_PACKET_LIGHT_LIGHT_PACKET_MAKER_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef MORPHRAY_CPU_PACKET_LIGHT_LIGHT_PACKET_MAKER_INL_H
#undef MORPHRAY_CPU_PACKET_LIGHT_LIGHT_PACKET_MAKER_INL_H
#else
#define MORPHRAY_CPU_PACKET_LIGHT_LIGHT_PACKET_MAKER_INL_H
#endif

#include <hwy/highway.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>

#include "common/interop/packet_bounds.h"
#include "cpu/packet/light/light_packet.h"
#include "cpu/packet/light/light_packet_blocks-inl.h"
#include "cpu/packet/light/light_packet_plane-inl.h"
#include "cpu/packet/light/light_packet_regroup-inl.h"
#include "cpu/packet/packet_frame-inl.h"
#include "cpu/simd/hit_rule-inl.h"

HWY_BEFORE_NAMESPACE();
namespace mray::cpu {
namespace HWY_NAMESPACE {

/// One ray of every block with this step tells well enough where the packet goes. More of them cost
/// more than they save (lab/notes/cpu_tracer.md).
inline constexpr std::uint32_t kSampleStep = 17;

/// Rays are prefetched this many blocks ahead of the current one (lab/notes/cpu_tracer.md).
inline constexpr std::uint32_t kBlocksAhead = 24;

/// Prefetches a block of rays. Behind the last block there are those of the next packet, or memory
/// that is never read.
HWY_INLINE void prefetch_block(const SharedOriginRays* rays, std::uint32_t block) {
    const auto first = reinterpret_cast<std::uintptr_t>(rays) + block * sizeof(SharedOriginRays);
    prefetch(reinterpret_cast<const void*>(first), sizeof(SharedOriginRays));
}

/// Reduces each of kGroupBlocks vectors to one of kGroupBlocks floats. combine: min or max of two
/// vectors.
template <class Combine>
HWY_INLINE void reduce_lanes(const float* vectors, Combine combine, float* out) {
    for (std::size_t k = 0; k < kGroupBlocks; k += 4) {
        FloatVec four[4];
        for (std::size_t i = 0; i < 4; ++i) four[i] = load(vectors + (k + i) * kLanes);
        reduce_four(four, combine, out + k);
    }
}

/// The least z of a ray in a packet, which the bounds of rounding assume.
inline constexpr float kLeastZ = 0.25f;

/// Bounds of x, y and 1 / z of blocks while their group is made: a vector each, not reduced yet.
struct alignas(64) GroupBounds {
    PlaneRectangles<kGroupBlocks * kLanes> rectangles;
    float q[kGroupBlocks * kLanes];

    /// Reduces them and stores them as those of a group.
    HWY_INLINE void store(std::uint32_t group, LightPacket& packet) const {
        const auto lesser = [](auto a, auto b) HWY_ATTR { return hn::Min(a, b); };
        const auto greater = [](auto a, auto b) HWY_ATTR { return hn::Max(a, b); };
        const std::uint32_t first = group * kGroupBlocks;
        reduce_lanes(rectangles.lower_x, lesser, packet.blocks.lower_x + first);
        reduce_lanes(rectangles.upper_x, greater, packet.blocks.upper_x + first);
        reduce_lanes(rectangles.lower_y, lesser, packet.blocks.lower_y + first);
        reduce_lanes(rectangles.upper_y, greater, packet.blocks.upper_y + first);
        reduce_lanes(q, lesser, packet.block_q + first);
    }
};

/// Makes the rays of one block. The plane has the sampled unit, which may still change.
HWY_INLINE void make_light_block(const SharedOriginRays& rays, const LightPlane& plane,
                                 std::uint32_t block, LightPacket& packet, GroupBounds& bounds,
                                 FloatVec& least_z) {
    const FloatVec far = splat(kEmptyLower);
    RectangleLanes around(PlaneRectangle::none());
    FloatVec least_q = splat(kDone);
    for (std::size_t l = 0; l < kBlockRays; l += kLanes) {
        const std::size_t r = block * kBlockRays + l;
        FloatVec d[3], tfar, h[3];
        load_rays(rays, l, d, tfar);
        const Mask on = tfar >= zero();
        plane.project(d, h);
        const FloatVec z = select(on, h[2], splat(1.0f));
        const FloatVec rz = splat(1.0f) / z;
        const FloatVec x = zero_unless(on, h[0] * rz);
        const FloatVec y = zero_unless(on, h[1] * rz);
        least_z = min(least_z, z);
        store(x, packet.x + r);
        store(y, packet.y + r);
        // Only hits nearer than tfar concern the ray.
        const FloatVec q = rz / select(on, tfar, splat(1.0f));
        const FloatVec q_lower = select(on, q * splat(1 - kEndError), splat(kDone));
        store(q_lower, packet.q_lower + r);
        least_q = min(least_q, q_lower);
        around.add(
            {select(on, x, far), select(on, x, -far), select(on, y, far), select(on, y, -far)});
    }
    const std::size_t own = block % kGroupBlocks * kLanes;
    around.put(bounds.rectangles, own);
    store(least_q, bounds.q + own);
}

/// Makes the regrouped blocks of these rays, sixteen each.
HWY_NOINLINE inline void make_regrouped_blocks(const LightPlane& plane,
                                               std::span<const std::uint16_t> rays,
                                               LightPacket& packet, FloatVec& least_z) {
    packet.regrouped_count =
        static_cast<std::uint32_t>((rays.size() + kBlockRays - 1) / kBlockRays);
    const std::uint32_t groups = (packet.regrouped_count + kGroupBlocks - 1) / kGroupBlocks;
    GroupBounds bounds;
    for (std::uint32_t i = 0; i < groups * kGroupBlocks; ++i) {
        SharedOriginRays& own = packet.regrouped[i];
        own = SharedOriginRays::none();
        for (std::uint32_t k = 0; k < kBlockRays; ++k) {
            const std::uint32_t at = i * kBlockRays + k;
            const std::uint16_t ray = at < rays.size() ? rays[at] : kNoRay;
            packet.regrouped_ray[at] = ray;
            if (ray != kNoRay) own.set(k, packet.rays[ray / kBlockRays].ray({}, ray % kBlockRays));
        }
        make_light_block(own, plane, kLightPacketBlocks + i, packet, bounds, least_z);
        if (i % kGroupBlocks == kGroupBlocks - 1)
            bounds.store((kLightPacketBlocks + i) / kGroupBlocks, packet);
    }
}

/// Regroups the active rays of some blocks by where they go through the plane, and deactivates
/// these blocks.
HWY_NOINLINE inline void regroup_blocks(const LightPlane& plane, const LightPacketBlocks& blocks,
                                        LightPacket& packet, FloatVec& least_z) {
    const Cells square = cells_around(packet, blocks);
    RayOrder<Cells::kCount> order;
    const auto cell_of = [&](std::uint32_t r)
                             HWY_ATTR { return square.of(load(packet.x + r), load(packet.y + r)); };
    sort_rays(packet.rays, blocks, cell_of, order);
    deactivate_blocks(packet, blocks);
    make_regrouped_blocks(plane, order.of_keys(0, Cells::kCount), packet, least_z);
}

/// The rays of blocks that spread more than kWide times as far as those of the median block are
/// regrouped, if these are at least kFewBlocks. Blocks that still spread more than kTooWide times
/// as far are deactivated; their rays become fallback rays.
inline constexpr float kWide = 1.6f;
inline constexpr float kTooWide = 12;
inline constexpr std::size_t kFewBlocks = 2;

/// Makes all blocks of a packet in place. Returns the least z of their rays.
HWY_INLINE FloatVec make_light_blocks(const LightPlane& plane, LightPacket& packet) {
    FloatVec least_z = splat(kEmptyLower);
    GroupBounds bounds;
    for (std::uint32_t block = 0; block < packet.square_count * kSquareBlocks; ++block) {
        prefetch_block(packet.rays, block + kBlocksAhead);
        make_light_block(packet.rays[block], plane, block, packet, bounds, least_z);
        if (block % kGroupBlocks == kGroupBlocks - 1) bounds.store(block / kGroupBlocks, packet);
    }
    return least_z;
}

/// Regroups the rays of wide blocks and finds the fallback blocks. Returns false if no ray is
/// active.
HWY_INLINE bool regroup_wide_blocks(const LightPlane& plane, LightPacket& packet,
                                    LightPacketBlocks& fallback, FloatVec& least_z) {
    Spreads spreads;
    LightPacketBlocks regrouped = {};
    const std::uint32_t count = packet.square_count * kSquareBlocks;
    measure_spreads(packet, 0, count, spreads);
    if (spreads.used == 0) return false;
    const float median = median_of_blocks(spreads.of_block, count, spreads.used);
    const std::size_t wide = blocks_wider(spreads, 0, count, kWide * median, regrouped);
    if (wide >= kFewBlocks) {
        regroup_blocks(plane, regrouped, packet, least_z);
        const std::uint32_t end = kLightPacketBlocks + regrouped_groups(packet) * kGroupBlocks;
        measure_spreads(packet, kLightPacketBlocks, end, spreads);
        blocks_wider(spreads, kLightPacketBlocks, end, kTooWide * median, fallback);
        deactivate_blocks(packet, fallback);
    } else if (wide != 0) {
        blocks_wider(spreads, 0, count, kTooWide * median, fallback);
        deactivate_blocks(packet, fallback);
    }
    return true;
}

/// Makes a packet of some squares of rays that start at `org`. Returns false if they spread too
/// widely for one plane, or if there is no ray. fallback: receives the blocks whose rays have too
/// little in common with the others and are not traced; it is empty before.
bool make_light_packet(vec3 org, const SharedOriginRays* rays, std::uint32_t squares,
                       LightPacket& packet, LightPacketBlocks& fallback) {
    Samples samples;
    take_samples(rays, squares, kSampleStep, samples);
    if (samples.count == 0) take_samples(rays, squares, 1, samples);
    LightPlane plane;
    if (!choose_plane(samples, plane)) return false;
    packet.square_count = squares;
    packet.regrouped_count = 0;
    packet.rays = rays;
    FloatVec least_z = make_light_blocks(plane, packet);
    if (!(least_lane(least_z) > kLeastZ)) return false;
    if (!regroup_wide_blocks(plane, packet, fallback, least_z)) return false;
    return set_plane(org, plane, packet);
}

// Rays that spread too widely for one plane: a packet for each face of a cube around their origin.

/// Faces are numbered by axis, first the one in its positive direction.
inline constexpr std::uint32_t kFaces = 6;

/// The active rays by face, and on a face by cell.
using FaceOrder = RayOrder<kFaces * Cells::kCount>;

/// face * Cells::kCount + cell of some directions; that of (1, 0, 0) where not `on`.
HWY_INLINE UintVec cells_of_faces(const FloatVec dir[3], Mask on) {
    const FloatVec d[3] = {select(on, dir[0], splat(1.0f)), zero_unless(on, dir[1]),
                           zero_unless(on, dir[2])};
    const FloatVec size[3] = {abs(d[0]), abs(d[1]), abs(d[2])};
    const Mask is_x = (size[0] >= size[1]) & (size[0] >= size[2]);
    const Mask is_y = and_not(is_x, size[1] >= size[2]);
    const FloatVec largest = select(is_x, d[0], select(is_y, d[1], d[2]));
    const FloatVec scale = splat(1.0f) / abs(largest);
    const FloatVec x = select(is_x, d[1], d[0]) * scale;
    const FloatVec y = select(is_x | is_y, d[2], d[1]) * scale;
    const UintVec axis =
        select(uint_mask(is_x), splat(0u), select(uint_mask(is_y), splat(2u), splat(4u)));
    const UintVec negative = select(uint_mask(largest < zero()), splat(1u), splat(0u));
    constexpr float kHalfSide = 0.5f * Cells::kPerSide;
    const Cells cells = {-1, -1, kHalfSide, kHalfSide};
    static_assert(Cells::kCount == 256);
    return shift_left<8>(axis | negative) | cells.of(x, y);
}

/// Sorts the active rays of some squares by face and cell.
HWY_INLINE void sort_by_face(const SharedOriginRays* rays, std::uint32_t squares,
                             FaceOrder& order) {
    LightPacketBlocks all = {};
    std::fill_n(all.of_group, squares * kSquareBlocks / kGroupBlocks, (1u << kGroupBlocks) - 1);
    const auto face_of = [&](std::uint32_t r) HWY_ATTR {
        FloatVec dir[3], tfar;
        load_rays(rays[r / kBlockRays], r % kBlockRays, dir, tfar);
        return cells_of_faces(dir, tfar >= zero());
    };
    sort_rays(rays, all, face_of, order);
}

/// Makes a packet of the rays of a face, all of them in regrouped blocks. Returns false, which no
/// canonical direction does, if they do not fit its plane.
HWY_INLINE bool make_face_packet(vec3 org, const SharedOriginRays* rays, std::uint32_t face,
                                 std::span<const std::uint16_t> of_face, LightPacket& packet) {
    LightPlane plane;
    plane.axis = face / 2;
    plane.sign = face % 2 == 0 ? 1.0f : -1.0f;
    // |x / z| and |y / z| are at most 1.
    plane.set_unit(plane_unit(1));
    packet.square_count = 0;
    packet.rays = rays;
    FloatVec least_z = splat(kEmptyLower);
    make_regrouped_blocks(plane, of_face, packet, least_z);
    return least_lane(least_z) > kLeastZ && set_plane(org, plane, packet);
}

}  // namespace HWY_NAMESPACE
}  // namespace mray::cpu
HWY_AFTER_NAMESPACE();

#endif
