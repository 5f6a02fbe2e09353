// Making packets: for a camera, and for a point light.

#if defined(MORPHRAY_PACKET_MAKER_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef MORPHRAY_PACKET_MAKER_INL_H
#undef MORPHRAY_PACKET_MAKER_INL_H
#else
#define MORPHRAY_PACKET_MAKER_INL_H
#endif

#include <hwy/highway.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstring>

#include "common/interop/camera.h"
#include "common/interop/slab.h"
#include "cpu/packet.h"
#include "cpu/rule_vectors-inl.h"
#include "cpu/tile.h"

HWY_BEFORE_NAMESPACE();
namespace morphray::cpu {
namespace HWY_NAMESPACE {

/// What a frame says of its rays in scene space, from the corners of a square that holds them all;
/// the square is convex, and so are the directions with one largest component and sign.
HWY_INLINE void bound_directions(PacketFrame& frame, const double axis_x[3], const double axis_y[3],
                                 const double axis_z[3]) {
    constexpr double kReach = 17;
    double least[3], most[3];
    double unit[2] = {0, 0};
    for (int axis = 0; axis < 3; ++axis) {
        const double spread = kReach * (std::abs(axis_x[axis]) + std::abs(axis_y[axis]));
        const double towards = std::abs(axis_z[axis]);
        least[axis] = towards - spread;
        most[axis] = towards + spread;
        unit[0] += std::abs(axis_x[axis]);
        unit[1] += std::abs(axis_y[axis]);
    }
    frame.unit = static_cast<float>(std::max(unit[0], unit[1]) * 1.001);
    frame.axis = kMixedAxes;
    for (std::uint32_t axis = 0; axis < 3; ++axis) {
        if (least[axis] <= 1.0001 * std::max(most[(axis + 1) % 3], most[(axis + 2) % 3])) continue;
        frame.axis = axis;
        frame.depth_row[0] = static_cast<float>(axis_x[axis]);
        frame.depth_row[1] = static_cast<float>(axis_y[axis]);
        frame.depth_row[2] = static_cast<float>(axis_z[axis]);
        frame.depth_least = static_cast<float>(least[axis] * 0.999);
        frame.depth_most = static_cast<float>(most[axis] * 1.001);
    }
}

/// The frame whose plane point (X, Y) lies at org + axis_x X + axis_y Y + axis_z.
HWY_INLINE void set_frame(PacketFrame& frame, vec3 org, const double axis_x[3],
                          const double axis_y[3], const double axis_z[3]) {
    const auto cross = [](const double* p, const double* q, double* out) {
        out[0] = p[1] * q[2] - p[2] * q[1];
        out[1] = p[2] * q[0] - p[0] * q[2];
        out[2] = p[0] * q[1] - p[1] * q[0];
    };
    cross(axis_y, axis_z, frame.rows[0]);
    cross(axis_z, axis_x, frame.rows[1]);
    cross(axis_x, axis_y, frame.rows[2]);
    const double det =
        axis_x[0] * frame.rows[0][0] + axis_x[1] * frame.rows[0][1] + axis_x[2] * frame.rows[0][2];
    for (int k = 0; k < 3; ++k) {
        frame.row_size[k] = 0;
        for (int axis = 0; axis < 3; ++axis) {
            frame.rows[k][axis] /= det;
            frame.rows_f[k][axis] = static_cast<float>(frame.rows[k][axis]);
            frame.row_size[k] += std::abs(frame.rows_f[k][axis]);
        }
    }
    frame.org = org;
    frame.depth_error = box_dilation(org);
    frame.volume = static_cast<float>(std::abs(det) * 0.999);
    bound_directions(frame, axis_x, axis_y, axis_z);
}

/// canonical_direction() of vectors, in the same operations.
HWY_INLINE void canonical_directions(VF d[3], VF& scale) {
    const Floats f;
    const Words w;
    const VF largest = hn::Max(hn::Max(hn::Abs(d[0]), hn::Abs(d[1])), hn::Abs(d[2]));
    const VW exponent = hn::And(hn::BitCast(w, largest), hn::Set(w, 0x7F800000u));
    scale = hn::BitCast(f, hn::Sub(hn::Set(w, 0x7F000000u), exponent));
    scale = hn::IfThenElse(hn::Gt(largest, hn::Zero(f)), scale, splat(1.0f));
    for (int axis = 0; axis < 3; ++axis) {
        const VF x = hn::Mul(d[axis], scale);
        const VF snapped = hn::Sub(hn::Add(x, splat(kDirectionSnap)), splat(kDirectionSnap));
        d[axis] = hn::IfThenElse(hn::Ge(hn::Abs(x), splat(kDirectionOnGrid)), x, snapped);
    }
}

/// Bounds of all rays of each block that are active (q_lower != kDone), and of the packet.
HWY_INLINE void bound_blocks(Packet& packet) {
    const Floats f;
    PacketFrame& frame = packet.frame;
    frame.lower_x = frame.lower_y = 1e30f;
    frame.upper_x = frame.upper_y = -1e30f;
    frame.block_extent = 0;
    for (std::uint32_t block = 0; block < kPacketBlocks; ++block) {
        VF lower_x = splat(1e30f), upper_x = splat(-1e30f), lower_y = splat(1e30f),
           upper_y = splat(-1e30f);
        VF q = splat(kDone);
        for (std::size_t l = 0; l < kBlockRays; l += hn::Lanes(f)) {
            const std::size_t r = block * kBlockRays + l;
            const VF own_q = hn::Load(f, packet.q_lower + r);
            const Mask active = hn::Lt(own_q, splat(kDone));
            const VF x = hn::Load(f, packet.x + r);
            const VF y = hn::Load(f, packet.y + r);
            lower_x = hn::Min(lower_x, hn::IfThenElse(active, x, lower_x));
            upper_x = hn::Max(upper_x, hn::IfThenElse(active, x, upper_x));
            lower_y = hn::Min(lower_y, hn::IfThenElse(active, y, lower_y));
            upper_y = hn::Max(upper_y, hn::IfThenElse(active, y, upper_y));
            q = hn::Min(q, own_q);
        }
        const float margin = 2 * frame.ray_error;
        packet.block_lower_x[block] = hn::GetLane(hn::MinOfLanes(f, lower_x)) - margin;
        packet.block_upper_x[block] = hn::GetLane(hn::MaxOfLanes(f, upper_x)) + margin;
        packet.block_lower_y[block] = hn::GetLane(hn::MinOfLanes(f, lower_y)) - margin;
        packet.block_upper_y[block] = hn::GetLane(hn::MaxOfLanes(f, upper_y)) + margin;
        packet.block_q[block] = hn::GetLane(hn::MinOfLanes(f, q));
        if (packet.block_lower_x[block] > packet.block_upper_x[block]) continue;
        frame.lower_x = std::min(frame.lower_x, packet.block_lower_x[block]);
        frame.upper_x = std::max(frame.upper_x, packet.block_upper_x[block]);
        frame.lower_y = std::min(frame.lower_y, packet.block_lower_y[block]);
        frame.upper_y = std::max(frame.upper_y, packet.block_upper_y[block]);
        frame.block_extent = std::max(
            frame.block_extent, packet.block_upper_x[block] - packet.block_lower_x[block] +
                                    packet.block_upper_y[block] - packet.block_lower_y[block]);
    }
}

/// The frame of a camera's tile of at most 32 x 32 pixels, and the bounds of its blocks: all that a
/// first look at the tree needs. The plane's unit is a pixel, its origin the middle of the square.
void frame_camera_packet(const ImageParams& params, const Tile& tile, Packet& packet) {
    const Camera& camera = params.camera;
    double axis_x[3], axis_y[3], axis_z[3];
    float largest = 0;
    for (int axis = 0; axis < 3; ++axis) {
        axis_x[axis] = camera.du[axis];
        axis_y[axis] = camera.dv[axis];
        axis_z[axis] = camera.corner[axis] + axis_x[axis] * (tile.x0 + 0.5 * kPacketSide) +
                       axis_y[axis] * (tile.y0 + 0.5 * kPacketSide);
        largest = std::max({largest, std::abs(camera.corner[axis]),
                            std::abs(camera.du[axis]) * static_cast<float>(params.width),
                            std::abs(camera.dv[axis]) * static_cast<float>(params.height)});
    }
    PacketFrame& frame = packet.frame;
    set_frame(frame, camera.org, axis_x, axis_y, axis_z);
    float spread = 0;
    for (int k = 0; k < 3; ++k) {
        for (int axis = 0; axis < 3; ++axis) {
            spread += std::abs(frame.rows_f[k][axis]) *
                      (std::abs(camera.du[axis]) + std::abs(camera.dv[axis])) * 17;
        }
    }
    // 5 roundings of parts of `spread`, of x / z itself, and 2^-45 of a direction that was put on
    // its grid.
    frame.ray_error = 0x1p-21f * (spread + 32) + 0x1p-44f * (frame.row_size[0] + frame.row_size[1]);
    // A direction is off its pixel's middle by 4 roundings of values up to `largest` an axis.
    frame.grid_margin =
        2 * frame.ray_error +
        0x1p-21f * largest * (frame.row_size[0] + frame.row_size[1] + 17 * frame.row_size[2]);
    frame.block_extent = 2 * kBlockSide + 2 * frame.grid_margin;
    frame.lower_x = frame.lower_y = -15.5f - frame.grid_margin;
    frame.upper_x = static_cast<float>(tile.x1 - tile.x0) - 16.5f + frame.grid_margin;
    frame.upper_y = static_cast<float>(tile.y1 - tile.y0) - 16.5f + frame.grid_margin;
    for (std::uint32_t block = 0; block < kPacketBlocks; ++block) {
        const bool inside = tile.x0 + block % kBlocksPerSide * kBlockSide < tile.x1 &&
                            tile.y0 + block / kBlocksPerSide * kBlockSide < tile.y1;
        packet.block_q[block] = inside ? 0.0f : kDone;
    }
    packet.winners.clear();
}

/// The camera rays of a tile whose frame is set. x and y are those of the direction that
/// camera_ray() rounds to, not of the pixel's exact middle: rows * (d - c) for a float vector c
/// near it, where the difference is exact up to 2^-24 of at most some 16 pixels, plus rows * c from
/// double.
void make_camera_rays(const ImageParams& params, const Tile& tile, Packet& packet) {
    const Floats f;
    const Camera& camera = params.camera;
    const PacketFrame& frame = packet.frame;
    float centre[3];
    float at_centre[3];
    for (int axis = 0; axis < 3; ++axis) {
        centre[axis] = static_cast<float>(camera.corner[axis] +
                                          double{camera.du[axis]} * (tile.x0 + 0.5 * kPacketSide) +
                                          double{camera.dv[axis]} * (tile.y0 + 0.5 * kPacketSide));
    }
    for (int k = 0; k < 3; ++k) {
        at_centre[k] =
            static_cast<float>(frame.rows[k][0] * centre[0] + frame.rows[k][1] * centre[1] +
                               frame.rows[k][2] * centre[2]);
    }
    alignas(64) float pixel_x[kBlockRays], pixel_y[kBlockRays];
    for (std::uint32_t i = 0; i < kBlockRays; ++i) {
        pixel_x[i] = static_cast<float>(i % kBlockSide);
        pixel_y[i] = static_cast<float>(i / kBlockSide);
    }
    for (std::uint32_t block = 0; block < kPacketBlocks; ++block) {
        const std::uint32_t x0 = tile.x0 + block % kBlocksPerSide * kBlockSide;
        const std::uint32_t y0 = tile.y0 + block / kBlocksPerSide * kBlockSide;
        for (std::size_t l = 0; l < kBlockRays; l += hn::Lanes(f)) {
            const std::size_t r = block * kBlockRays + l;
            const VF ix = hn::Add(splat(static_cast<float>(x0)), hn::Load(f, pixel_x + l));
            const VF iy = hn::Add(splat(static_cast<float>(y0)), hn::Load(f, pixel_y + l));
            const VF px = hn::Add(ix, splat(0.5f));
            const VF py = hn::Add(iy, splat(0.5f));
            VF d[3], from_centre[3];
            for (int axis = 0; axis < 3; ++axis) {
                // camera_direction(), in its operations.
                d[axis] = hn::Add(
                    hn::Add(splat(camera.corner[axis]), hn::Mul(splat(camera.du[axis]), px)),
                    hn::Mul(splat(camera.dv[axis]), py));
                from_centre[axis] = hn::Sub(d[axis], splat(centre[axis]));
            }
            VF h[3];
            for (int k = 0; k < 3; ++k) {
                const float* row = frame.rows_f[k];
                h[k] = hn::MulAdd(
                    splat(row[0]), from_centre[0],
                    hn::MulAdd(splat(row[1]), from_centre[1],
                               hn::MulAdd(splat(row[2]), from_centre[2], splat(at_centre[k]))));
            }
            VF scale;
            canonical_directions(d, scale);
            hn::Store(d[0], f, packet.dir[0] + r);
            hn::Store(d[1], f, packet.dir[1] + r);
            hn::Store(d[2], f, packet.dir[2] + r);
            hn::Store(splat(kInfiniteT), f, packet.tfar + r);
            const VF rz = hn::Div(splat(1.0f), h[2]);
            hn::Store(hn::Mul(h[0], rz), f, packet.x + r);
            hn::Store(hn::Mul(h[1], rz), f, packet.y + r);
            hn::Store(hn::Mul(h[2], scale), f, packet.z_per_t + r);
            const Mask inside = hn::And(hn::Lt(ix, splat(static_cast<float>(tile.x1))),
                                        hn::Lt(iy, splat(static_cast<float>(tile.y1))));
            const VF q = hn::IfThenElse(inside, hn::Zero(f), splat(kDone));
            hn::Store(q, f, packet.q_lower + r);
            hn::Store(q, f, packet.q_upper + r);
            hn::Store(hn::Set(Words(), kNoWinner), Words(), packet.winner + r);
        }
    }
}

/// row . d where the three products nearly cancel: with the errors of products and sums where the
/// target has a fused multiply-add (T. Ogita, S. Rump, S. Oishi. Accurate sum and dot product.
/// 2005, algorithm Dot2).
HWY_INLINE VF cancelling_dot(const double row[3], const VF d[3]) {
    VF sum = hn::Zero(Floats());
    VF error = hn::Zero(Floats());
    for (int axis = 0; axis < 3; ++axis) {
        const auto high = static_cast<float>(row[axis]);
        const auto low = static_cast<float>(row[axis] - high);
        const VF product = hn::Mul(splat(high), d[axis]);
#if HWY_NATIVE_FMA
        const VF product_error = hn::MulSub(splat(high), d[axis], product);
#else
        const VF product_error = hn::Zero(Floats());
#endif
        const VF next = hn::Add(sum, product);
        const VF part = hn::Sub(next, sum);
        const VF sum_error = hn::Add(hn::Sub(sum, hn::Sub(next, part)), hn::Sub(product, part));
        error = hn::Add(error, hn::MulAdd(splat(low), d[axis], hn::Add(product_error, sum_error)));
        sum = next;
    }
    return hn::Add(sum, error);
}

/// Directions and tfar of consecutive rays.
HWY_INLINE void load_rays(const Ray* rays, VF d[3], VF& tfar) {
    const Floats f;
    constexpr std::size_t kLanes = hn::MaxLanes(Floats());
    static_assert(sizeof(Ray) == 8 * sizeof(float) && offsetof(Ray, dir) == 4 * sizeof(float));
    alignas(64) float lanes[4 * kLanes];
    for (std::size_t i = 0; i < hn::Lanes(f); ++i)
        std::memcpy(lanes + 4 * i, &rays[i].dir, 4 * sizeof(float));
    hn::LoadInterleaved4(f, lanes, d[0], d[1], d[2], tfar);
}

HWY_INLINE Mask load_active(const std::uint8_t* active) {
    const hn::Rebind<std::uint8_t, Words> bytes;
    const VW wide = hn::PromoteTo(Words(), hn::LoadU(bytes, active));
    return hn::RebindMask(Floats(), hn::Ne(wide, hn::Zero(Words())));
}

/// A unit vector near all active directions, and two across.
HWY_INLINE bool choose_axes(const Ray* rays, const std::uint8_t* active, double axes[3][3]) {
    const Floats f;
    VF sum[3] = {hn::Zero(f), hn::Zero(f), hn::Zero(f)};
    for (std::size_t r = 0; r < kPacketRays; r += hn::Lanes(f)) {
        VF d[3], tfar;
        load_rays(rays + r, d, tfar);
        const Mask on = load_active(active + r);
        for (int axis = 0; axis < 3; ++axis)
            sum[axis] = hn::Add(sum[axis], hn::IfThenElseZero(on, d[axis]));
    }
    double* mean = axes[2];
    double length = 0;
    for (int axis = 0; axis < 3; ++axis) {
        mean[axis] = hn::GetLane(hn::SumOfLanes(f, sum[axis]));
        length += mean[axis] * mean[axis];
    }
    if (!(length > 0)) return false;
    for (int axis = 0; axis < 3; ++axis) mean[axis] /= std::sqrt(length);
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

/// Where x, y of the active rays of each block spread more than eight times as far as those of the
/// median block, as they do where the surface under the block ends, they would make all bounds
/// coarse: those blocks are made inactive. Which they are, and the largest |x| or |y| of the
/// others.
HWY_INLINE std::uint64_t leave_out_wide_blocks(Packet& packet, float& extent) {
    const Floats f;
    float spread[kPacketBlocks];
    float reach[kPacketBlocks];
    float sorted[kPacketBlocks];
    std::uint32_t used = 0;
    for (std::uint32_t block = 0; block < kPacketBlocks; ++block) {
        VF least[2] = {splat(1e30f), splat(1e30f)};
        VF most[2] = {splat(-1e30f), splat(-1e30f)};
        for (std::size_t l = 0; l < kBlockRays; l += hn::Lanes(f)) {
            const std::size_t r = block * kBlockRays + l;
            const Mask active = hn::Lt(hn::Load(f, packet.q_lower + r), splat(kDone));
            const VF values[2] = {hn::Load(f, packet.x + r), hn::Load(f, packet.y + r)};
            for (int k = 0; k < 2; ++k) {
                least[k] = hn::Min(least[k], hn::IfThenElse(active, values[k], least[k]));
                most[k] = hn::Max(most[k], hn::IfThenElse(active, values[k], most[k]));
            }
        }
        float lower[2], upper[2];
        for (int k = 0; k < 2; ++k) {
            lower[k] = hn::GetLane(hn::MinOfLanes(f, least[k]));
            upper[k] = hn::GetLane(hn::MaxOfLanes(f, most[k]));
        }
        spread[block] = upper[0] - lower[0] + upper[1] - lower[1];
        reach[block] = std::max({-lower[0], upper[0], -lower[1], upper[1]});
        if (spread[block] >= 0) sorted[used++] = spread[block];
    }
    extent = 0x1p-16f;
    if (used == 0) return 0;
    std::nth_element(sorted, sorted + used / 2, sorted + used);
    std::uint64_t left_out = 0;
    for (std::uint32_t block = 0; block < kPacketBlocks; ++block) {
        if (spread[block] < 0) continue;
        if (spread[block] <= 8 * sorted[used / 2]) {
            extent = std::max(extent, reach[block]);
            continue;
        }
        left_out |= std::uint64_t{1} << block;
        for (std::uint32_t i = 0; i < kBlockRays; ++i) {
            packet.q_lower[block * kBlockRays + i] = packet.q_upper[block * kBlockRays + i] = kDone;
        }
    }
    return left_out;
}

/// Makes a packet of up to 32 x 32 rays that start at one point; rays[i] of the square is active if
/// active[i] != 0. False if they spread too widely to be seen from one plane, or none is active.
/// left_out: the blocks of which nothing is asked because their rays have too little in common.
bool make_point_packet(vec3 org, const Ray* rays, const std::uint8_t* active, Packet& packet,
                       std::uint64_t& left_out) {
    const Floats f;
    double axes[3][3];
    if (!choose_axes(rays, active, axes)) return false;
    VF least_z = splat(1e30f);
    for (std::size_t r = 0; r < kPacketRays; r += hn::Lanes(f)) {
        VF d[3], tfar;
        load_rays(rays + r, d, tfar);
        const Mask on = load_active(active + r);
        const VF z = cancelling_dot(axes[2], d);
        const VF safe_z = hn::IfThenElse(on, z, splat(1.0f));
        const VF x = hn::IfThenElseZero(on, hn::Div(cancelling_dot(axes[0], d), safe_z));
        const VF y = hn::IfThenElseZero(on, hn::Div(cancelling_dot(axes[1], d), safe_z));
        least_z = hn::Min(least_z, safe_z);
        for (int axis = 0; axis < 3; ++axis) d[axis] = hn::IfThenElseZero(on, d[axis]);
        hn::Store(d[0], f, packet.dir[0] + r);
        hn::Store(d[1], f, packet.dir[1] + r);
        hn::Store(d[2], f, packet.dir[2] + r);
        hn::Store(tfar, f, packet.tfar + r);
        hn::Store(x, f, packet.x + r);
        hn::Store(y, f, packet.y + r);
        hn::Store(safe_z, f, packet.z_per_t + r);
        // Only what lies nearer than tfar matters.
        const VF q = hn::Div(splat(1.0f), hn::Mul(safe_z, hn::IfThenElse(on, tfar, splat(1.0f))));
        hn::Store(hn::IfThenElse(on, hn::Mul(q, splat(1 - 0x1p-18f)), splat(kDone)), f,
                  packet.q_lower + r);
        hn::Store(hn::IfThenElse(on, hn::Mul(q, splat(1 + 0x1p-18f)), splat(kDone)), f,
                  packet.q_upper + r);
    }
    if (!(hn::GetLane(hn::MinOfLanes(f, least_z)) > 0.25f)) return false;
    float extent = 0;
    left_out = leave_out_wide_blocks(packet, extent);
    // A power of two, so that scaling x and y rounds nothing.
    const double unit = std::exp2(std::ceil(std::log2(extent / 16.0)));
    const auto scale = static_cast<float>(1 / unit);
    for (std::size_t r = 0; r < kPacketRays; r += hn::Lanes(f)) {
        hn::Store(hn::Mul(hn::Load(f, packet.x + r), splat(scale)), f, packet.x + r);
        hn::Store(hn::Mul(hn::Load(f, packet.y + r), splat(scale)), f, packet.y + r);
    }
    for (int axis = 0; axis < 3; ++axis) {
        axes[0][axis] *= unit;
        axes[1][axis] *= unit;
    }
    PacketFrame& frame = packet.frame;
    set_frame(frame, org, axes[0], axes[1], axes[2]);
    // Of x, y up to 16: 2^-22 from the division. Of the dots: what is left of errors of errors, or
    // without a fused multiply-add three roundings of products of magnitude up to 2 row_size, over
    // z > 1/4.
    const float dot_error = HWY_NATIVE_FMA ? 0x1p-40f : 0x1p-19f;
    frame.ray_error =
        0x1p-17f + dot_error * (frame.row_size[0] + frame.row_size[1] + 16 * frame.row_size[2]);
    packet.winners.clear();
    bound_blocks(packet);
    return true;
}

}  // namespace HWY_NAMESPACE
}  // namespace morphray::cpu
HWY_AFTER_NAMESPACE();

#endif
