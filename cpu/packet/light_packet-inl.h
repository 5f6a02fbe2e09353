// Makes light packets of rays that start at one point and have any directions. Their plane is
// chosen from samples. Rays of wide blocks, which lie where a surface ends in the image, are
// regrouped with their neighbours. Rays too wide for one plane have a packet for each face of a
// cube.
#include <algorithm>
#include <cmath>
#include <span>

#include "common/interop/packet_bounds.h"
#include "cpu/packet/packet_plane-inl.h"
#include "cpu/packet/packets.h"

HWY_BEFORE_NAMESPACE();
namespace mray::cpu::HWY_NAMESPACE {

HWY_INLINE void update_quad_depth(LightPacket& packet, std::uint32_t quad) {
    const float* q = packet.block_q + quad * kQuadBlocks;
    packet.quad_q[quad] = std::min(std::min(q[0], q[1]), std::min(q[2], q[3]));
}

/// Updates block_q of a block from its rays, and quad_q of its quad.
HWY_INLINE void update_depth(LightPacket& packet, std::uint32_t block) {
    packet.block_q[block] = least_q(packet.q_lower + block * kBlockRays);
    update_quad_depth(packet, block / kQuadBlocks);
}

/// Loads as many rays of a block as there are lanes, from `first` on.
HWY_INLINE void load_rays(const SharedOriginRays& rays, std::size_t first, FloatVec d[3],
                          FloatVec& tfar) {
    for (int axis = 0; axis < 3; ++axis) d[axis] = load(rays.dir[axis] + first);
    tfar = load(rays.tfar + first);
}

HWY_INLINE std::uint32_t regrouped_groups(const LightPacket& packet) {
    return (packet.regrouped_count + kGroupBlocks - 1) / kGroupBlocks;
}

// ---- The plane

/// The plane's unit is chosen so that |x| and |y| are at most this.
inline constexpr float kPlaneHalf = 0.5f * kLightPacketSide;

/// The unit for |x|, |y| up to `extent`, a power of two. Nearly parallel rays get no tiny unit.
inline double plane_unit(double extent) {
    constexpr double kLeastExtent = 0x1p-16;
    return std::exp2(std::ceil(std::log2(std::max(extent, kLeastExtent) / kPlaneHalf)));
}

struct Samples {
    vec3 dirs[kLightPacketBlocks];
    std::size_t count = 0;
};

/// One ray of every block with this step tells where the packet goes (lab/notes/cpu_tracer.md).
inline constexpr std::uint32_t kSampleStep = 17;

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
/// x and y belong to a plane across the mean, which boxes and triangles do not look slanted in.
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
    glm::dvec3 unit(0);
    unit[least] = 1;
    const glm::dvec3 first = unit - mean * mean[least], second = glm::cross(mean, unit);
    for (std::uint32_t i = 0; i < 2; ++i) {
        const std::uint32_t axis = plane.beside(i);
        plane.origin[i] = static_cast<float>(mean[axis] / along);
        plane.rows[0][i] = static_cast<float>(along * first[axis] / size);
        plane.rows[1][i] = static_cast<float>(along * second[axis] / size);
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

// ---- Wide blocks

/// Blocks of a light packet, by group, as bits.
struct LightPacketBlocks {
    std::uint32_t of_group[kLightPacketGroups];
};

HWY_INLINE bool has_block(const LightPacketBlocks& blocks, std::uint32_t block) {
    return (blocks.of_group[block / kGroupBlocks] >> block % kGroupBlocks & 1) != 0;
}

template <class Visit>
HWY_INLINE void for_each_block(const LightPacketBlocks& blocks, Visit visit) {
    for (std::uint32_t group = 0; group < kLightPacketGroups; ++group) {
        for (const std::uint32_t own : BitsOf(blocks.of_group[group]))
            visit(group * kGroupBlocks + own);
    }
}

/// The median of `used` positive numbers among `size`, the others being infinite, or up to an
/// eighth less: found bit by bit, which takes less time than sorting (lab/notes/cpu_tracer.md).
HWY_INLINE float median_of_blocks(const float* values, std::size_t size, std::size_t used) {
    constexpr int kHighest = 30, kLowest = 20;  // the exponent and 3 bits of the mantissa
    std::uint32_t median = 0;
    for (int bit = kHighest; bit >= kLowest; --bit) {
        const std::uint32_t trial = median | std::uint32_t{1} << bit;
        const FloatVec bound = splat(std::bit_cast<float>(trial));
        std::size_t below = 0;
        for (std::size_t b = 0; b < size; b += kLanes) below += count(load(values + b) < bound);
        if (below <= used / 2) median = trial;
    }
    return std::bit_cast<float>(median);
}

/// How far the active rays of each block spread in x and y together; infinite without any.
struct Spreads {
    alignas(64) float of_block[kAllLightPacketBlocks];
    std::size_t used = 0;  // blocks with active rays
};

HWY_INLINE void measure_spreads(const LightPacket& packet, std::uint32_t first, std::uint32_t end,
                                Spreads& spreads) {
    spreads.used = 0;
    for (std::size_t b = first; b < end; b += kLanes) {
        const RectangleLanes r(packet.blocks, b);
        const FloatVec own = r.upper_x - r.lower_x + (r.upper_y - r.lower_y);
        const Mask is_used = own >= zero();
        spreads.used += count(is_used);
        store(select(is_used, own, splat(kDone)), spreads.of_block + b);
    }
}

/// Adds the blocks of [first, end) whose rays spread farther than `width`. Returns their number.
HWY_INLINE std::size_t blocks_wider(const Spreads& spreads, std::uint32_t first, std::uint32_t end,
                                    float width, LightPacketBlocks& wide) {
    std::size_t blocks = 0;
    for (std::size_t b = first; b < end; b += kLanes) {
        const FloatVec own = load(spreads.of_block + b);
        const Mask wider = (own > splat(width)) & (own < splat(kDone));
        wide.of_group[b / kGroupBlocks] |= bits_of(wider) << b % kGroupBlocks;
        blocks += count(wider);
    }
    return blocks;
}

/// Square cells of the plane, numbered in Morton order.
struct Cells {
    static constexpr std::uint32_t kPerSide = 16;
    static constexpr std::uint32_t kCount = kPerSide * kPerSide;

    float lower_x, lower_y;
    float scale_x, scale_y;

    /// The cells of points; the nearest cells of points outside.
    HWY_INLINE UintVec of(FloatVec x, FloatVec y) const {
        // Spreads the bits of a number to every other place.
        const auto spread = [](UintVec v) HWY_ATTR {
            v = (v | shift_left<2>(v)) & splat(0x33u);
            return (v | shift_left<1>(v)) & splat(0x55u);
        };
        const auto number = [](FloatVec v) HWY_ATTR {
            const FloatVec inside = min(max(v, zero()), splat(static_cast<float>(kPerSide - 1)));
            return as_uint(hn::ConvertTo(kInts, inside));
        };
        const UintVec column = number((x - splat(lower_x)) * splat(scale_x));
        const UintVec row = number((y - splat(lower_y)) * splat(scale_y));
        return spread(column) | shift_left<1>(spread(row));
    }
};

HWY_INLINE Cells cells_around(const LightPacket& packet, const LightPacketBlocks& blocks) {
    PlaneRectangle r = PlaneRectangle::none();
    for_each_block(blocks, [&](std::uint32_t block) { r.add(packet.blocks[block]); });
    constexpr float kSide = Cells::kPerSide;
    constexpr float kLeastExtent = 1e-20f;  // no scale overflows
    return {r.lower_x, r.lower_y, kSide / std::max(r.upper_x - r.lower_x, kLeastExtent),
            kSide / std::max(r.upper_y - r.lower_y, kLeastExtent)};
}

/// Active rays of a packet in the order of keys below kKeys.
template <std::uint32_t kKeys>
struct RayOrder {
    std::uint16_t rays[kLightPacketRays];
    /// Where the rays of each key end in `rays`.
    std::uint16_t end[kKeys + 1] = {};

    std::span<const std::uint16_t> of_keys(std::uint32_t first, std::uint32_t after) const {
        const std::uint32_t begin = first == 0 ? 0 : end[first - 1];
        return std::span(rays).subspan(begin, end[after - 1] - begin);
    }
};

/// Sorts the active rays of some blocks by key_of(r): the keys of as many rays as there are lanes,
/// from r on.
template <std::uint32_t kKeys, class KeyOf>
HWY_INLINE void sort_rays(const SharedOriginRays* all, const LightPacketBlocks& blocks,
                          KeyOf key_of, RayOrder<kKeys>& order) {
    std::uint16_t rays[kLightPacketRays], keys[kLightPacketRays];
    // Counted one place higher, the place of the next ray of each key: in the end, where they end.
    std::uint16_t* const next = order.end;
    std::size_t count = 0;
    for_each_block(blocks, [&](std::uint32_t block) HWY_ATTR {
        const std::uint32_t first = block * kBlockRays;
        for (std::uint32_t r = first; r < first + kBlockRays; r += kLanes) {
            alignas(64) std::uint32_t own[kLanes];
            store(key_of(r), own);
            for (std::uint32_t l = 0; l < kLanes; ++l) {
                const bool is_active = all[block].has(r - first + l);
                rays[count] = static_cast<std::uint16_t>(r + l);
                keys[count] = static_cast<std::uint16_t>(own[l]);
                next[own[l] + 1] = static_cast<std::uint16_t>(next[own[l] + 1] + is_active);
                count += is_active;
            }
        }
    });
    for (std::uint32_t key = 1; key < kKeys; ++key)
        next[key] = static_cast<std::uint16_t>(next[key] + next[key - 1]);
    for (std::size_t i = 0; i < count; ++i) order.rays[next[keys[i]]++] = rays[i];
}

HWY_INLINE void deactivate_blocks(LightPacket& packet, const LightPacketBlocks& blocks) {
    for_each_block(blocks, [&](std::uint32_t block) {
        packet.blocks.set(block, PlaneRectangle::none());
        packet.block_q[block] = kDone;
    });
}

// ---- Blocks

/// Rays are prefetched this many blocks ahead of the current one (lab/notes/cpu_tracer.md).
inline constexpr std::uint32_t kBlocksAhead = 24;

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

/// Bounds of x, y and 1 / z of blocks while their group is made: a vector each, not reduced yet.
struct alignas(64) GroupBounds {
    PlaneRectangles<kGroupBlocks * kLanes> rectangles;
    float q[kGroupBlocks * kLanes];

    /// Reduces them and stores them as the bounds of a group.
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

HWY_NOINLINE inline void make_regrouped_blocks(const LightPlane& plane,
                                               std::span<const std::uint16_t> rays,
                                               LightPacket& packet, FloatVec& least_z) {
    packet.regrouped_count =
        static_cast<std::uint32_t>((rays.size() + kBlockRays - 1) / kBlockRays);
    GroupBounds bounds;
    for (std::uint32_t i = 0; i < regrouped_groups(packet) * kGroupBlocks; ++i) {
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

/// The rays of blocks that spread more than kWide times as far as the median block are regrouped,
/// if these are at least kFewBlocks. The rays of blocks that still spread more than kTooWide times
/// as far become fallback rays.
inline constexpr float kWide = 1.6f;
inline constexpr float kTooWide = 12;
inline constexpr std::size_t kFewBlocks = 2;

/// Makes all blocks in place. Returns the least z of their rays.
HWY_INLINE FloatVec make_light_blocks(const LightPlane& plane, LightPacket& packet) {
    constexpr std::size_t kRaysSize = sizeof(SharedOriginRays);
    FloatVec least_z = splat(kEmptyLower);
    GroupBounds bounds;
    for (std::uint32_t block = 0; block < packet.square_count * kSquareBlocks; ++block) {
        // Behind the last block lie the blocks of the next packet, or memory that is never read.
        const auto rays = reinterpret_cast<std::uintptr_t>(packet.rays);
        prefetch(reinterpret_cast<const void*>(rays + (block + kBlocksAhead) * kRaysSize),
                 kRaysSize);
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
    if (wide == 0) return true;
    if (wide >= kFewBlocks) {
        regroup_blocks(plane, regrouped, packet, least_z);
        const std::uint32_t end = kLightPacketBlocks + regrouped_groups(packet) * kGroupBlocks;
        measure_spreads(packet, kLightPacketBlocks, end, spreads);
        blocks_wider(spreads, kLightPacketBlocks, end, kTooWide * median, fallback);
    } else {
        blocks_wider(spreads, 0, count, kTooWide * median, fallback);
    }
    deactivate_blocks(packet, fallback);
    return true;
}

// ---- The frame

/// The largest |x / z| or |y / z| of a packet from the plane's origin, and the least z of its rays.
/// The bounds of rounding assume both.
inline constexpr float kWidestPlane = 1.5f;
inline constexpr float kLeastZ = 0.25f;

/// Calls visit(first, end) for the blocks in place and for the regrouped blocks, in whole groups.
template <class Visit>
HWY_INLINE void for_each_range(const LightPacket& packet, Visit visit) {
    visit(0, packet.square_count * kSquareBlocks);
    const std::uint32_t groups = regrouped_groups(packet);
    if (groups != 0) visit(kLightPacketBlocks, kLightPacketBlocks + groups * kGroupBlocks);
}

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
/// plane's unit (lab/proofs/packet_rays.g). extent: the largest |x| or |y|.
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

// ---- The packet

/// Makes a packet of some squares of rays that start at `org`. Returns false if they spread too
/// widely for one plane, or if there is no ray. fallback: receives blocks that are not traced,
/// because their rays have too little in common with the others; it is empty before.
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

}  // namespace mray::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
