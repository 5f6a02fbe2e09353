// Making packets: their frames, and the rays of a camera.

#if defined(MORPHRAY_CPU_PACKET_CAMERA_PACKET_MAKER_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef MORPHRAY_CPU_PACKET_CAMERA_PACKET_MAKER_INL_H
#undef MORPHRAY_CPU_PACKET_CAMERA_PACKET_MAKER_INL_H
#else
#define MORPHRAY_CPU_PACKET_CAMERA_PACKET_MAKER_INL_H
#endif

#include <hwy/highway.h>

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "common/interop/camera.h"
#include "common/interop/slab.h"
#include "cpu/image/tile.h"
#include "cpu/packet/packet.h"
#include "cpu/simd/fast_hit_rule-inl.h"

HWY_BEFORE_NAMESPACE();
namespace morphray::cpu {
namespace HWY_NAMESPACE {

/// The largest |a - b t| for t = p / q, no more than 1 in magnitude, of p and q from ranges.
HWY_INLINE double most_across(double a, double b, const double p[2], const double q[2]) {
    double least = -1, most = 1;
    if (q[0] > 0 || q[1] < 0) {
        const double ends[4] = {p[0] / q[0], p[0] / q[1], p[1] / q[0], p[1] / q[1]};
        least = std::max(least, *std::min_element(ends, ends + 4));
        most = std::min(most, *std::max_element(ends, ends + 4));
    }
    return std::max(std::abs(a - b * least), std::abs(a - b * most));
}

/// What a frame says of its rays in scene space, from the corners of a square that holds them all;
/// the square is convex, and so are the directions with one largest component and sign.
HWY_INLINE void bound_directions(PacketFrame& frame, const double axis_x[3], const double axis_y[3],
                                 const double axis_z[3]) {
    double least[3], most[3];
    double range[3][2];
    double unit[2] = {0, 0};
    for (int axis = 0; axis < 3; ++axis) {
        const double spread = frame.reach * (std::abs(axis_x[axis]) + std::abs(axis_y[axis]));
        const double towards = std::abs(axis_z[axis]);
        least[axis] = towards - spread;
        most[axis] = towards + spread;
        range[axis][0] = axis_z[axis] - spread;
        range[axis][1] = axis_z[axis] + spread;
        unit[0] += std::abs(axis_x[axis]);
        unit[1] += std::abs(axis_y[axis]);
    }
    frame.unit = static_cast<float>(std::max(unit[0], unit[1]) * 1.001);
    frame.axis = kMixedAxes;
    frame.axis_count = 0;
    frame.depth_most = 0;
    frame.across = 0;
    // Of each ray's largest component.
    const double largest = std::max(least[0], std::max(least[1], least[2]));
    for (std::uint32_t axis = 0; axis < 3; ++axis) {
        if (largest > 1.0001 * most[axis]) continue;
        frame.axis = axis;
        float* const row = frame.depth_rows[frame.axis_count++];
        row[0] = static_cast<float>(axis_x[axis]);
        row[1] = static_cast<float>(axis_y[axis]);
        row[2] = static_cast<float>(axis_z[axis]);
        frame.depth_most = std::max(frame.depth_most, static_cast<float>(most[axis] * 1.001));
        for (const double* step : {axis_x, axis_y}) {
            double across = 0;
            for (const std::uint32_t other : {(axis + 1) % 3, (axis + 2) % 3})
                across += most_across(step[other], step[axis], range[other], range[axis]);
            frame.across = std::max(frame.across, static_cast<float>(across * 1.001));
        }
    }
    if (frame.axis_count != 1) frame.axis = kMixedAxes;
    if (!(largest > 0)) {  // of rays that spread so widely nothing is known
        frame.axis_count = 0;
        return;
    }
    frame.depth_least = static_cast<float>(largest * 0.999);
    frame.per_depth = 1 / frame.depth_least;
}

/// The frame whose plane point (X, Y) lies at org + axis_x X + axis_y Y + axis_z, for |X|, |Y| up
/// to `reach`.
HWY_INLINE void set_frame(PacketFrame& frame, vec3 org, const double axis_x[3],
                          const double axis_y[3], const double axis_z[3], float reach) {
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
    frame.reach = reach;
    frame.dilation = box_dilation(org);
    frame.per_volume = static_cast<float>(1.001 / std::abs(det));
    bound_directions(frame, axis_x, axis_y, axis_z);
    // A hit is off by less than 9/16 of the dilation on any axis (docs/design/arithmetic.md,
    // "Boxes"): in z, that over a ray's largest component at z = 1. No ray is shorter than 1 there,
    // so it is at least 0.57, whatever the axes.
    frame.depth_error = frame.dilation;
    if (frame.axis_count != 0) frame.depth_error *= std::min(1.0f, 0.5625f * frame.per_depth);
}

/// scale_to_unit() of vectors that are above 0.
HWY_INLINE FloatVec scale_to_unit(FloatVec largest) {
    const UintVec exponent = as_uint(largest) & splat(0x7F800000u);
    return as_float(splat(0x7F000000u) - exponent);
}

/// A component of a direction that has been scaled, put on the grid as canonical_direction() does.
HWY_INLINE FloatVec snap_direction(FloatVec x) {
    const FloatVec snapped = x + splat(kDirectionSnap) - splat(kDirectionSnap);
    return select(abs(x) >= splat(kDirectionOnGrid), x, snapped);
}

/// canonical_direction() of vectors, in the same operations.
HWY_INLINE void canonical_directions(FloatVec d[3]) {
    const FloatVec largest = max(max(abs(d[0]), abs(d[1])), abs(d[2]));
    const Mask some = largest > zero();
    const FloatVec scale = select(some, scale_to_unit(largest), splat(1.0f));
    for (int axis = 0; axis < 3; ++axis) d[axis] = snap_direction(d[axis] * scale);
}

/// How far from the middle of its pixel, in a frame whose unit is a pixel, a camera's ray may be.
///
/// A component of the direction, (corner + du x) + dv y, is made by two products and two sums, each
/// off by 2^-24 of what comes out, and then put on a grid, off by 2^-45. What these errors come to
/// in the frame's rows is e = (e0, e1, e2), and the exact direction is (X, Y, 1) there, so that x
/// is off by (e0 - X e2) / (1 + e2), y alike.
HWY_INLINE float pixel_error(const PacketFrame& frame, const Camera& camera, const Tile& tile) {
    double beside = 0;
    double along = 0;
    double largest = 0;
    for (int axis = 0; axis < 3; ++axis) {
        const double du = camera.du[axis];
        const double dv = camera.dv[axis];
        const double left = camera.corner[axis] + du * tile.x0;
        const double right = camera.corner[axis] + du * tile.x1;
        const double top = dv * tile.y0;
        const double bottom = dv * tile.y1;
        const double products = std::abs(du * tile.x1) + std::abs(bottom);
        const double sum = std::max(std::abs(left), std::abs(right));
        const double all = std::max(std::max(std::abs(left + top), std::abs(left + bottom)),
                                    std::max(std::abs(right + top), std::abs(right + bottom)));
        const double error = 1.01 * 0x1p-24 * (products + sum + all);
        beside += std::max(std::abs(frame.rows[0][axis]), std::abs(frame.rows[1][axis])) * error;
        along += std::abs(frame.rows[2][axis]) * error;
        largest = std::max(largest, all);
    }
    const double snap = 0x1p-44 * largest;
    beside += snap * std::max(frame.row_size[0], frame.row_size[1]);
    along += snap * frame.row_size[2];
    const double error = 1.001 * (beside + frame.reach * along) / (1 - along);
    // Nothing is known of rays that are off by as much as that, nor in a frame that is as oblique:
    // the bounds of TriangleSetup take |X|, |Y| <= reach, and row_size[2] times a direction at z =
    // 1 for less than 2^18.
    const bool is_usable = along < 0.5 && error <= 2 && frame.row_size[2] * largest < 0x1p18;
    return is_usable ? static_cast<float>(error) : 1e30f;
}

/// The frame of a camera's tile of at most 64 x 64 pixels, and the bounds of its blocks: all that a
/// first look at the tree needs. The plane's unit is a pixel, its origin the middle of the square.
void frame_camera_packet(const ImageParams& params, const Tile& tile, Packet& packet) {
    const Camera& camera = params.camera;
    double axis_x[3], axis_y[3], axis_z[3];
    for (int axis = 0; axis < 3; ++axis) {
        axis_x[axis] = camera.du[axis];
        axis_y[axis] = camera.dv[axis];
        axis_z[axis] = camera.corner[axis] + axis_x[axis] * (tile.x0 + 0.5 * kCameraSide) +
                       axis_y[axis] * (tile.y0 + 0.5 * kCameraSide);
    }
    PacketFrame& frame = packet.frame;
    set_frame(frame, camera.org, axis_x, axis_y, axis_z, 0.5f * kCameraSide + 1);
    frame.ray_error = pixel_error(frame, camera, tile);
    frame.grid_margin = 2 * frame.ray_error + 0x1p-16f;
    frame.block_extent = 2 * kBlockSide + 2 * frame.grid_margin;
    constexpr float kFirst = 0.5f - 0.5f * kCameraSide;
    const std::uint32_t width = tile.x1 - tile.x0;
    const std::uint32_t height = tile.y1 - tile.y0;
    frame.lower_x = frame.lower_y = kFirst - frame.grid_margin;
    frame.upper_x = kFirst + static_cast<float>(width) - 1 + frame.grid_margin;
    frame.upper_y = kFirst + static_cast<float>(height) - 1 + frame.grid_margin;
    frame.grid_columns = (width + kBlockSide - 1) / kBlockSide;
    frame.grid_rows = (height + kBlockSide - 1) / kBlockSide;
    std::fill_n(packet.block_q, kGridBlocks, kDone);
    for (std::uint32_t row = 0; row < packet.frame.grid_rows; ++row)
        std::fill_n(packet.block_q + row * kGridSide, packet.frame.grid_columns, 0.0f);
    packet.hit_leaves.clear();
}

/// Makes the rays of a camera's tile whose frame is set ready to be traced.
void start_camera_rays(const ImageParams& params, const Tile& tile, Packet& packet) {
    packet.camera.first_x = static_cast<float>(tile.x0);
    packet.camera.first_y = static_cast<float>(tile.y0);
    for (int axis = 0; axis < 3; ++axis) {
        packet.camera.corner[axis] = params.camera.corner[axis];
        packet.camera.du[axis] = params.camera.du[axis];
        packet.camera.dv[axis] = params.camera.dv[axis];
    }
    const std::size_t count = packet.frame.grid_rows * kGridSide * kBlockRays;
    for (std::size_t r = 0; r < count; r += kLanes) {
        store(zero(), packet.q_lower + r);
        store(zero(), packet.q_upper + r);
        store(splat(kNoCandidate), packet.candidate + r);
    }
    // What the last blocks have beyond the tile.
    const std::uint32_t width = tile.x1 - tile.x0;
    const std::uint32_t height = tile.y1 - tile.y0;
    if (width % kBlockSide == 0 && height % kBlockSide == 0) return;
    for (std::uint32_t y = 0; y < packet.frame.grid_rows * kBlockSide; ++y) {
        for (std::uint32_t x = y < height ? width : 0; x < packet.frame.grid_columns * kBlockSide;
             ++x) {
            packet.q_lower[camera_packet_ray(x, y)] = kDone;
            packet.q_upper[camera_packet_ray(x, y)] = kDone;
        }
    }
}

/// Camera rays by their pixels' coordinates, as the rule takes them: camera_direction() and
/// canonical_direction(), in their operations.
HWY_INLINE void camera_directions(const CameraRays& camera, FloatVec x, FloatVec y, FloatVec d[3]) {
    const FloatVec px = x + splat(0.5f);
    const FloatVec py = y + splat(0.5f);
    for (int axis = 0; axis < 3; ++axis) {
        d[axis] =
            splat(camera.corner[axis]) + splat(camera.du[axis]) * px + splat(camera.dv[axis]) * py;
    }
    canonical_directions(d);
}

/// Those of any rays of a packet, by their indices.
HWY_INLINE void directions_of(const CameraRays& camera, UintVec rays, FloatVec d[3]) {
    const auto low = [](UintVec bits) HWY_ATTR { return bits & splat(3u); };
    const auto number = [](UintVec bits) HWY_ATTR { return hn::ConvertTo(kFloats, as_int(bits)); };
    static_assert(kBlockSide == 4 && kGridSide == 16);
    const UintVec blocks = shift_right<4>(rays);
    const UintVec columns = blocks & splat(15u);
    const UintVec x = shift_left<2>(columns) | low(shift_right<2>(rays));
    const UintVec y = shift_left<2>(shift_right<4>(blocks)) | low(rays);
    camera_directions(camera, number(x) + splat(camera.first_x), number(y) + splat(camera.first_y),
                      d);
}

}  // namespace HWY_NAMESPACE
}  // namespace morphray::cpu
HWY_AFTER_NAMESPACE();

#endif
