// Making packets of rays that start at one point and go anywhere, such as shadow rays from a light.

#if defined(MORPHRAY_PACKET_POINT_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef MORPHRAY_PACKET_POINT_INL_H
#undef MORPHRAY_PACKET_POINT_INL_H
#else
#define MORPHRAY_PACKET_POINT_INL_H
#endif

#include <hwy/cache_control.h>
#include <hwy/highway.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "cpu/packet.h"
#include "cpu/packet_maker-inl.h"
#include "cpu/packet_regroup-inl.h"
#include "cpu/rule_vectors-inl.h"

HWY_BEFORE_NAMESPACE();
namespace morphray::cpu {
namespace HWY_NAMESPACE {

static_assert(sizeof(Ray) == 8 * sizeof(float) && offsetof(Ray, dir) == 4 * sizeof(float));

#if HWY_TARGET != HWY_SCALAR
/// Directions and tfar of rays[0], rays[4], rays[8] ..., four floats each.
template <std::size_t kFloats>
HWY_INLINE auto load_every_fourth(const Ray* rays) {
    const hn::FixedTag<float, kFloats> floats;
    if constexpr (kFloats == 4) {
        return hn::LoadU(floats, &rays->dir.x);
    } else {
        return hn::Combine(floats, load_every_fourth<kFloats / 2>(rays + kFloats / 2),
                           load_every_fourth<kFloats / 2>(rays));
    }
}

#endif

/// Directions and tfar of consecutive rays.
HWY_INLINE void load_rays(const Ray* rays, VF d[3], VF& tfar) {
#if HWY_TARGET == HWY_SCALAR
    d[0] = splat(rays->dir.x);
    d[1] = splat(rays->dir.y);
    d[2] = splat(rays->dir.z);
    tfar = splat(rays->tfar);
#else
    const Floats f;
    const hn::Repartition<double, Floats> pairs;
    const auto row = [&](std::size_t i)
                         HWY_ATTR { return load_every_fourth<hn::MaxLanes(Floats())>(rays + i); };
    const VF r0 = row(0), r1 = row(1), r2 = row(2), r3 = row(3);
    const auto xy01 = hn::BitCast(pairs, hn::InterleaveLower(f, r0, r1));
    const auto xy23 = hn::BitCast(pairs, hn::InterleaveLower(f, r2, r3));
    const auto zw01 = hn::BitCast(pairs, hn::InterleaveUpper(f, r0, r1));
    const auto zw23 = hn::BitCast(pairs, hn::InterleaveUpper(f, r2, r3));
    d[0] = hn::BitCast(f, hn::InterleaveLower(pairs, xy01, xy23));
    d[1] = hn::BitCast(f, hn::InterleaveUpper(pairs, xy01, xy23));
    d[2] = hn::BitCast(f, hn::InterleaveLower(pairs, zw01, zw23));
    tfar = hn::BitCast(f, hn::InterleaveUpper(pairs, zw01, zw23));
#endif
}

// How far ahead of the rays that are made into a packet those are asked for that come next.
constexpr std::uint32_t kBlocksAhead = 24;

/// Asks for a block of rays. Behind the last one are those of the next packet, or nothing that
/// matters.
HWY_INLINE void prefetch_block(const Ray* rays, std::uint32_t block) {
    const auto first = reinterpret_cast<std::uintptr_t>(rays) + block * kBlockRays * sizeof(Ray);
    for (std::size_t i = 0; i < kBlockRays * sizeof(Ray); i += 64)
        hwy::Prefetch(reinterpret_cast<const char*>(first + i));
}

HWY_INLINE Mask load_active(const std::uint8_t* active) {
    const hn::Rebind<std::uint8_t, Words> bytes;
    const VW wide = hn::PromoteTo(Words(), hn::LoadU(bytes, active));
    return hn::RebindMask(Floats(), hn::Ne(wide, hn::Zero(Words())));
}

/// The sum of the directions of one active ray each of every step-th block.
HWY_INLINE void sum_directions(const Ray* rays, const std::uint8_t* active, std::uint32_t step,
                               double sum[3]) {
    for (std::uint32_t block = 0; block < kPointBlocks; block += step) {
        const std::uint8_t* own = active + block * kBlockRays;
        const std::uint8_t* end = own + kBlockRays;
        const std::uint8_t* first = std::find_if(own, end, [](std::uint8_t a) { return a != 0; });
        if (first == end) continue;
        const vec3 dir = rays[first - active].dir;
        for (int axis = 0; axis < 3; ++axis) sum[axis] += dir[axis];
    }
}

/// A unit vector near all active directions, axes[2], and two across; centre: the first again, of
/// about the length of the directions. False if there is none.
HWY_INLINE bool choose_axes(const Ray* rays, const std::uint8_t* active, double axes[3][3],
                            float centre[3]) {
    double sum[3] = {0, 0, 0};
    // The blocks of the diagonal say enough, and waiting for more of them in memory takes a tenth
    // of a packet's time.
    sum_directions(rays, active, kPointBlocksPerSide + 1, sum);
    if (sum[0] == 0 && sum[1] == 0 && sum[2] == 0) sum_directions(rays, active, 1, sum);
    const double length = std::sqrt(sum[0] * sum[0] + sum[1] * sum[1] + sum[2] * sum[2]);
    if (!(length > 0)) return false;
    double* mean = axes[2];
    for (int axis = 0; axis < 3; ++axis) {
        mean[axis] = sum[axis] / length;
        centre[axis] = static_cast<float>(mean[axis]);
    }
    int least = 0;
    for (int axis = 1; axis < 3; ++axis) {
        if (std::abs(mean[axis]) < std::abs(mean[least])) least = axis;
    }
    double size = 0;
    for (int axis = 0; axis < 3; ++axis) {
        axes[0][axis] = (axis == least ? 1.0 : 0.0) - mean[axis] * mean[least];
        size += axes[0][axis] * axes[0][axis];
    }
    for (int axis = 0; axis < 3; ++axis) axes[0][axis] /= std::sqrt(size);
    for (int axis = 0; axis < 3; ++axis) {
        const int next = (axis + 1) % 3;
        const int last = (axis + 2) % 3;
        axes[1][axis] = mean[next] * axes[0][last] - mean[last] * axes[0][next];
    }
    return true;
}

/// axes * d for directions d near the multiples of `centre`. With c the centre and l = d.k / c.k on
/// its largest axis k, that is axes * (d - l c) + l (axes * c): the difference is small and, fused,
/// rounds by 2^-24 of itself, and axes * c comes from double. In units of 2^-24, each row of the
/// first product is off by at most 5 |d - l c|: the difference, the row, three sums. d differs from
/// z axes[2] by at most sqrt(2) z s across if |x / z|, |y / z| <= s, and the difference by sqrt(3)
/// as much again along c: |d - l c| <= 3.9 z s. So x / z and y / z are off by 2^-19.6 s, and a part
/// in 2^22 of themselves by division. Without fused operations 2^-23 of |d| comes on top.
class NearDirections {
public:
    NearDirections(const double axes[3][3], const float centre[3]) {
        for (int axis = 0; axis < 3; ++axis) {
            centre_[axis] = centre[axis];
            if (std::abs(centre[axis]) > std::abs(centre[largest_])) largest_ = axis;
        }
        for (int k = 0; k < 3; ++k) {
            double sum = 0;
            for (int axis = 0; axis < 3; ++axis) {
                rows_[k][axis] = static_cast<float>(axes[k][axis]);
                sum += axes[k][axis] * centre[axis];
            }
            at_centre_[k] = static_cast<float>(sum);
        }
        reciprocal_ = 1.0f / centre_[largest_];
    }

    HWY_INLINE void project(const VF d[3], VF h[3]) const {
        const VF l = hn::Mul(d[largest_], splat(reciprocal_));
        VF across[3];
        for (int axis = 0; axis < 3; ++axis)
            across[axis] = hn::NegMulAdd(l, splat(centre_[axis]), d[axis]);
        for (int k = 0; k < 3; ++k) {
            h[k] = hn::Mul(l, splat(at_centre_[k]));
            for (int axis = 0; axis < 3; ++axis)
                h[k] = hn::MulAdd(splat(rows_[k][axis]), across[axis], h[k]);
        }
    }

private:
    float rows_[3][3];
    float at_centre_[3];
    float centre_[3];
    float reciprocal_;
    int largest_ = 0;
};

/// The largest lanes of four vectors.
HWY_INLINE void largest_lanes(const VF v[4], float out[4]) {
#if HWY_TARGET == HWY_SCALAR
    for (int k = 0; k < 4; ++k) out[k] = hn::GetLane(v[k]);
#else
    const Floats f;
    constexpr std::size_t kLanes = hn::MaxLanes(Floats());
    // As many vectors as are left when each holds two of the four, if it has room.
    constexpr std::size_t kCount = kLanes > 4 ? 2 : 4;
    alignas(64) float lanes[kCount * kLanes];
    for (std::size_t k = 0; k < kCount; ++k) {
        VF m = v[k];
        if constexpr (kCount == 2) {
            m = hn::Max(hn::ConcatLowerLower(f, v[2 * k + 1], v[2 * k]),
                        hn::ConcatUpperUpper(f, v[2 * k + 1], v[2 * k]));
        }
        if constexpr (kLanes == 16) m = hn::Max(m, hn::SwapAdjacentBlocks(m));
        m = hn::Max(m, hn::Shuffle2301(m));
        m = hn::Max(m, hn::Shuffle1032(m));
        hn::Store(m, f, lanes + k * kLanes);
    }
    for (std::size_t k = 0; k < 4; ++k) out[k] = lanes[k * kCount * kLanes / 4];
#endif
}

// The largest |x / z| or |y / z| of a packet. With NearDirections' s up to here, z is off by
// 2^-19.1 of itself, and q by 2^-18 at most.
constexpr float kWidestPlane = 1.5f;

/// Makes the rays of one block of a packet whose plane has yet no unit, and their bounds. rays,
/// active: those of the block.
HWY_INLINE void make_point_block(const Ray* rays, const std::uint8_t* active,
                                 const NearDirections& directions, std::uint32_t block,
                                 Packet& packet, VF& least_z) {
    const Floats f;
    const VF none = splat(-1e30f);
    VF bounds[4] = {none, none, none, none};  // of -x, x, -y, y
    VF least_q = splat(kDone);
    for (std::size_t l = 0; l < kBlockRays; l += hn::Lanes(f)) {
        const std::size_t r = block * kBlockRays + l;
        VF d[3], tfar, h[3];
        load_rays(rays + l, d, tfar);
        const Mask on = load_active(active + l);
        directions.project(d, h);
        const VF z = hn::IfThenElse(on, h[2], splat(1.0f));
        const VF rz = hn::Div(splat(1.0f), z);
        const VF x = hn::IfThenElseZero(on, hn::Mul(h[0], rz));
        const VF y = hn::IfThenElseZero(on, hn::Mul(h[1], rz));
        least_z = hn::Min(least_z, z);
        for (int axis = 0; axis < 3; ++axis)
            hn::Store(hn::IfThenElseZero(on, d[axis]), f, packet.dir[axis] + r);
        hn::Store(tfar, f, packet.tfar + r);
        hn::Store(x, f, packet.x + r);
        hn::Store(y, f, packet.y + r);
        // Only what lies nearer than tfar matters.
        const VF q = hn::Div(rz, hn::IfThenElse(on, tfar, splat(1.0f)));
        const VF q_lower = hn::IfThenElse(on, hn::Mul(q, splat(1 - 0x1p-18f)), splat(kDone));
        hn::Store(q_lower, f, packet.q_lower + r);
        hn::Store(hn::IfThenElse(on, hn::Mul(q, splat(1 + 0x1p-18f)), splat(kDone)), f,
                  packet.q_upper + r);
        least_q = hn::Min(least_q, q_lower);
        bounds[0] = hn::Max(bounds[0], hn::IfThenElse(on, hn::Neg(x), none));
        bounds[1] = hn::Max(bounds[1], hn::IfThenElse(on, x, none));
        bounds[2] = hn::Max(bounds[2], hn::IfThenElse(on, hn::Neg(y), none));
        bounds[3] = hn::Max(bounds[3], hn::IfThenElse(on, y, none));
    }
    float largest[4];
    largest_lanes(bounds, largest);
    packet.block_lower_x[block] = -largest[0];
    packet.block_upper_x[block] = largest[1];
    packet.block_lower_y[block] = -largest[2];
    packet.block_upper_y[block] = largest[3];
    packet.block_q[block] = hn::GetLane(hn::MinOfLanes(f, least_q));
}

/// Puts the active rays of some blocks together anew, by where they go through the plane.
HWY_NOINLINE inline void regroup_blocks(const Ray* rays, const std::uint8_t* active,
                                        const NearDirections& directions, std::uint64_t blocks,
                                        Packet& packet, VF& least_z) {
    CellOrder order;
    sort_by_cell(packet, active, blocks, order);
    std::size_t done = 0;
    for (; blocks != 0; blocks &= blocks - 1) {
        const auto block = static_cast<std::uint32_t>(__builtin_ctzll(blocks));
        Ray own[kBlockRays];
        std::uint8_t own_active[kBlockRays];
        for (std::uint32_t i = 0; i < kBlockRays; ++i) {
            const bool is_any = done < order.count;
            packet.place[block * kBlockRays + i] = is_any ? order.rays[done] : kNoPlace;
            own[i] = rays[order.rays[is_any ? done : 0]];
            own_active[i] = is_any;
            done += is_any;
        }
        make_point_block(own, own_active, directions, block, packet, least_z);
    }
}

/// The largest |x| or |y| of the active rays.
HWY_INLINE float plane_extent(const Packet& packet) {
    const Floats f;
    VF extents = splat(0x1p-16f);
    for (std::size_t b = 0; b < kPointBlocks; b += hn::Lanes(f)) {
        const VF lower =
            hn::Min(hn::Load(f, packet.block_lower_x + b), hn::Load(f, packet.block_lower_y + b));
        const VF upper =
            hn::Max(hn::Load(f, packet.block_upper_x + b), hn::Load(f, packet.block_upper_y + b));
        extents = hn::Max(extents, hn::Max(hn::Neg(lower), upper));
    }
    return hn::GetLane(hn::MaxOfLanes(f, extents));
}

/// Gives the plane its unit, and the frame the bounds of all blocks. scale: a power of two, so that
/// nothing is rounded.
HWY_INLINE void scale_plane(Packet& packet, float scale) {
    const Floats f;
    PacketFrame& frame = packet.frame;
    for (std::size_t r = 0; r < kPointRays; r += hn::Lanes(f)) {
        hn::Store(hn::Mul(hn::Load(f, packet.x + r), splat(scale)), f, packet.x + r);
        hn::Store(hn::Mul(hn::Load(f, packet.y + r), splat(scale)), f, packet.y + r);
    }
    const float margin = 2 * frame.ray_error;
    VF lower_x = splat(1e30f), lower_y = splat(1e30f), upper_x = splat(-1e30f),
       upper_y = splat(-1e30f), extent = hn::Zero(f);
    const auto scaled = [&](float* bound, float own_margin) HWY_ATTR {
        const VF v = hn::MulAdd(hn::Load(f, bound), splat(scale), splat(own_margin));
        hn::Store(v, f, bound);
        return v;
    };
    for (std::size_t b = 0; b < kPointBlocks; b += hn::Lanes(f)) {
        const VF lx = scaled(packet.block_lower_x + b, -margin);
        const VF ux = scaled(packet.block_upper_x + b, margin);
        const VF ly = scaled(packet.block_lower_y + b, -margin);
        const VF uy = scaled(packet.block_upper_y + b, margin);
        lower_x = hn::Min(lower_x, lx);
        upper_x = hn::Max(upper_x, ux);
        lower_y = hn::Min(lower_y, ly);
        upper_y = hn::Max(upper_y, uy);
        extent = hn::Max(extent, hn::Add(hn::Sub(ux, lx), hn::Sub(uy, ly)));
    }
    frame.lower_x = hn::GetLane(hn::MinOfLanes(f, lower_x));
    frame.upper_x = hn::GetLane(hn::MaxOfLanes(f, upper_x));
    frame.lower_y = hn::GetLane(hn::MinOfLanes(f, lower_y));
    frame.upper_y = hn::GetLane(hn::MaxOfLanes(f, upper_y));
    frame.block_extent = hn::GetLane(hn::MaxOfLanes(f, extent));
}

// Blocks with rays that spread more than this many times as far as those of the median block are
// put together anew, if there are a few; those that then still spread so much farther are left out.
constexpr float kWide = 1.6f;
constexpr float kTooWide = 8;
constexpr std::size_t kFewBlocks = 2;

/// Makes a packet of up to 32 x 32 rays that start at one point; rays[i] of the square is active if
/// active[i] != 0. False if they spread too widely to be seen from one plane,
/// or none is active. left_out: the blocks of which nothing is asked because their rays have too
/// little in common; moved: those whose rays are where packet.place says.
bool make_point_packet(vec3 org, const Ray* rays, const std::uint8_t* active, Packet& packet,
                       std::uint64_t& left_out, std::uint64_t& moved) {
    const Floats f;
    double axes[3][3];
    float centre[3];
    if (!choose_axes(rays, active, axes, centre)) return false;
    const NearDirections directions(axes, centre);
    VF least_z = splat(1e30f);
    for (std::uint32_t block = 0; block < kPointBlocks; ++block) {
        prefetch_block(rays, block + kBlocksAhead);
        make_point_block(rays + block * kBlockRays, active + block * kBlockRays, directions, block,
                         packet, least_z);
    }
    if (!(hn::GetLane(hn::MinOfLanes(f, least_z)) > 0.25f)) return false;
    Spreads spreads = measure_spreads(packet);
    if (spreads.used == 0) return false;
    const float median = median_of_blocks(spreads.of_block, spreads.used);
    moved = blocks_wider(spreads, kWide * median);
    if (hwy::PopCount(moved) < kFewBlocks) moved = 0;
    if (moved != 0) {
        regroup_blocks(rays, active, directions, moved, packet, least_z);
        spreads = measure_spreads(packet);
    }
    left_out = blocks_wider(spreads, kTooWide * median);
    leave_out_blocks(packet, left_out);
    const float extent = plane_extent(packet);
    if (extent > kWidestPlane) return false;
    const double unit = std::exp2(std::ceil(std::log2(extent / 16.0)));
    for (int axis = 0; axis < 3; ++axis) {
        axes[0][axis] *= unit;
        axes[1][axis] *= unit;
    }
    PacketFrame& frame = packet.frame;
    set_frame(frame, org, axes[0], axes[1], axes[2], 0.5f * kPointSide + 1);
    // Of x, y up to 16 as NearDirections derives it; without a fused multiply-add the roundings of
    // products of magnitude up to 2 row_size, over z > 1/4.
    const float dot_error = HWY_NATIVE_FMA ? 0x1p-40f : 0x1p-19f;
    frame.ray_error =
        0x1p-15f + dot_error * (frame.row_size[0] + frame.row_size[1] + 16 * frame.row_size[2]);
    scale_plane(packet, static_cast<float>(1 / unit));
    packet.won_leaves.clear();
    return true;
}

}  // namespace HWY_NAMESPACE
}  // namespace morphray::cpu
HWY_AFTER_NAMESPACE();

#endif
