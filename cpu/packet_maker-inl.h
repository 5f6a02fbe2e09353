// Making packets: their frames, and the rays of a camera.

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
HWY_INLINE void canonical_directions(VF d[3]) {
    const Floats f;
    const Words w;
    const VF largest = hn::Max(hn::Max(hn::Abs(d[0]), hn::Abs(d[1])), hn::Abs(d[2]));
    const VW exponent = hn::And(hn::BitCast(w, largest), hn::Set(w, 0x7F800000u));
    VF scale = hn::BitCast(f, hn::Sub(hn::Set(w, 0x7F000000u), exponent));
    scale = hn::IfThenElse(hn::Gt(largest, hn::Zero(f)), scale, splat(1.0f));
    for (int axis = 0; axis < 3; ++axis) {
        const VF x = hn::Mul(d[axis], scale);
        const VF snapped = hn::Sub(hn::Add(x, splat(kDirectionSnap)), splat(kDirectionSnap));
        d[axis] = hn::IfThenElse(hn::Ge(hn::Abs(x), splat(kDirectionOnGrid)), x, snapped);
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
    packet.won_leaves.clear();
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
            canonical_directions(d);
            hn::Store(d[0], f, packet.dir[0] + r);
            hn::Store(d[1], f, packet.dir[1] + r);
            hn::Store(d[2], f, packet.dir[2] + r);
            const VF rz = hn::Div(splat(1.0f), h[2]);
            hn::Store(hn::Mul(h[0], rz), f, packet.x + r);
            hn::Store(hn::Mul(h[1], rz), f, packet.y + r);
            const Mask inside = hn::And(hn::Lt(ix, splat(static_cast<float>(tile.x1))),
                                        hn::Lt(iy, splat(static_cast<float>(tile.y1))));
            const VF q = hn::IfThenElse(inside, hn::Zero(f), splat(kDone));
            hn::Store(q, f, packet.q_lower + r);
            hn::Store(q, f, packet.q_upper + r);
            hn::Store(hn::Set(Words(), kNoWinner), Words(), packet.winner + r);
        }
    }
}

}  // namespace HWY_NAMESPACE
}  // namespace morphray::cpu
HWY_AFTER_NAMESPACE();

#endif
