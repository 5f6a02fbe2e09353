// Making camera packets: the frame of a tile, and the directions of its rays.

#if defined(MORPHRAY_CPU_PACKET_CAMERA_CAMERA_PACKET_MAKER_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef MORPHRAY_CPU_PACKET_CAMERA_CAMERA_PACKET_MAKER_INL_H
#undef MORPHRAY_CPU_PACKET_CAMERA_CAMERA_PACKET_MAKER_INL_H
#else
#define MORPHRAY_CPU_PACKET_CAMERA_CAMERA_PACKET_MAKER_INL_H
#endif

#include <hwy/highway.h>

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "common/interop/camera.h"
#include "cpu/packet/camera/camera_packet.h"
#include "cpu/packet/packet_frame-inl.h"
#include "cpu/packet/packet_frame.h"
#include "cpu/packet/packet_node-inl.h"
#include "cpu/simd/hit_rule-inl.h"

HWY_BEFORE_NAMESPACE();
namespace mray::cpu {
namespace HWY_NAMESPACE {

/// canonical_direction() in place.
HWY_INLINE void canonical_directions(FloatVec d[3]) {
    const lanes::Float3 canonical = lanes::canonical_direction(lanes::Float3(d));
    d[0] = canonical.x;
    d[1] = canonical.y;
    d[2] = canonical.z;
}

/// The limits of a usable frame: rays are off by at most kMostPixelError pixels (TriangleSetup
/// assumes |X|, |Y| <= reach, which has room for them), directions by less than kMostDepthError of
/// themselves along z, and row_size[2] times a direction is below kMostOblique
/// (lab/proofs/packet_volume.g).
inline constexpr double kMostPixelError = 2;
inline constexpr double kMostDepthError = 0.5;
inline constexpr double kMostOblique = 0x1p18;

/// Stands for an error that has no bound. Such rays are not traced as a packet: they might not even
/// have a z above 0 in its frame.
inline constexpr float kNoPixelError = 1e30f;

/// An upper bound of how far a camera ray may be from the middle of its pixel, in pixels;
/// kNoPixelError if the tile's rays are too inexact or too oblique for the bounds, or lie in one
/// plane.
///
/// 1. A direction's component is fl(fl(corner + fl(du x)) + fl(dv y)): two products and two sums,
///    each off by 1.01 u of its result (`error`; kDirectionRounding is the device's bound).
/// 2. It is then put on the grid of directions: off by 2^-45 of the largest component (`snap` has
///    2^-44).
/// 3. In the frame's rows the errors add up to e = (e0, e1, e2) with |e0|, |e1| <= beside and |e2|
///    <= along.
/// 4. The exact direction is (X, Y, 1) there, so x is off by (e0 - X e2) / (1 + e2), y likewise: at
///    most (beside + reach * along) / (1 - along).
HWY_INLINE float pixel_error(const PacketFrame& frame, const Camera& camera, const Tile& tile) {
    constexpr double kRounding = 1.01 * 0x1p-24;
    constexpr double kSnap = 0x1p-44;
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
        const double error = kRounding * (products + sum + all);
        beside += std::max(std::abs(frame.rows[0][axis]), std::abs(frame.rows[1][axis])) * error;
        along += std::abs(frame.rows[2][axis]) * error;
        largest = std::max(largest, all);
    }
    const double snap = kSnap * largest;
    beside += snap * std::max(frame.row_size[0], frame.row_size[1]);
    along += snap * frame.row_size[2];
    const double error = kWiden * (beside + frame.reach * along) / (1 - along);
    // False for NaN, too.
    const bool is_usable = along < kMostDepthError && error <= kMostPixelError &&
                           frame.row_size[2] * largest < kMostOblique;
    return is_usable ? static_cast<float>(error) : kNoPixelError;
}

/// The part of grid_margin for the rounding of sums with places up to 64: 2^-16, as
/// kRectangleRounding.
inline constexpr float kGridRounding = 0x1p-16f;

/// Sets what follows from the ray_error of a frame and the number of rays on each side, and the
/// blocks' depths.
HWY_INLINE void start_blocks(std::uint32_t width, std::uint32_t height, CameraPacket& packet) {
    CameraFrame& frame = packet.frame;
    frame.grid_margin = 2 * frame.ray_error + kGridRounding;
    frame.block_extent = 2 * kBlockSide + 2 * frame.grid_margin;
    constexpr float kFirst = 0.5f - 0.5f * kCameraSide;
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

/// Sets the frame of a camera's tile of at most 64 x 64 pixels, and its blocks' depths: all that
/// the root of the tree needs. Returns false if the tile has no such frame.
bool frame_camera_packet(const ImageParams& params, const Tile& tile, CameraPacket& packet) {
    const Camera& camera = params.camera;
    const glm::dvec3 x(camera.du), y(camera.dv);
    const PlaneAxes axes = {x, y,
                            glm::dvec3(camera.corner) + x * (tile.x0 + 0.5 * kCameraSide) +
                                y * (tile.y0 + 0.5 * kCameraSide)};
    CameraFrame& frame = packet.frame;
    set_frame(frame, camera.org, axes, 0.5f * kCameraSide + 1);
    frame.ray_error = pixel_error(frame, camera, tile);
    if (frame.ray_error == kNoPixelError) return false;
    start_blocks(tile.x1 - tile.x0, tile.y1 - tile.y0, packet);
    set_wedges(frame, axes);
    return true;
}

/// Resets the rays of a packet: no candidate, any depth.
HWY_INLINE void start_rays(std::uint32_t width, std::uint32_t height, CameraPacket& packet) {
    const std::size_t count = packet.frame.grid_rows * kGridSide * kBlockRays;
    for (std::size_t r = 0; r < count; r += kLanes) {
        store(zero(), packet.q_lower + r);
        store(zero(), packet.q_upper + r);
        store(splat(kNoCandidate), packet.candidate + r);
    }
    // The last blocks may reach beyond the tile.
    if (width % kBlockSide == 0 && height % kBlockSide == 0) return;
    for (std::uint32_t y = 0; y < packet.frame.grid_rows * kBlockSide; ++y) {
        for (std::uint32_t x = y < height ? width : 0; x < packet.frame.grid_columns * kBlockSide;
             ++x) {
            packet.q_lower[camera_packet_ray(x, y)] = kDone;
            packet.q_upper[camera_packet_ray(x, y)] = kDone;
        }
    }
}

/// Resets the rays of a camera's tile whose frame is set: no candidate, any depth.
void start_camera_rays(const ImageParams& params, const Tile& tile, CameraPacket& packet) {
    packet.stored = nullptr;
    packet.camera.first_x = static_cast<float>(tile.x0);
    packet.camera.first_y = static_cast<float>(tile.y0);
    for (int axis = 0; axis < 3; ++axis) {
        packet.camera.corner[axis] = params.camera.corner[axis];
        packet.camera.du[axis] = params.camera.du[axis];
        packet.camera.dv[axis] = params.camera.dv[axis];
    }
    start_rays(tile.x1 - tile.x0, tile.y1 - tile.y0, packet);
}

/// The directions of camera rays by their pixels' coordinates: canonical_direction() of
/// camera_direction(), in their operations.
HWY_INLINE void camera_directions(const CameraRays& camera, FloatVec x, FloatVec y, FloatVec d[3]) {
    const FloatVec px = x + splat(0.5f);
    const FloatVec py = y + splat(0.5f);
    for (int axis = 0; axis < 3; ++axis) {
        d[axis] =
            splat(camera.corner[axis]) + splat(camera.du[axis]) * px + splat(camera.dv[axis]) * py;
    }
    canonical_directions(d);
}

/// The directions of a packet's rays by their indices.
HWY_INLINE void directions_of(const CameraPacket& packet, UintVec rays, FloatVec d[3]) {
    if (packet.stored != nullptr) {
        for (int axis = 0; axis < 3; ++axis)
            d[axis] = hn::GatherIndex(kFloats, packet.stored->d[axis], as_int(rays));
        return;
    }
    const CameraRays& camera = packet.camera;
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
}  // namespace mray::cpu
HWY_AFTER_NAMESPACE();

#endif
