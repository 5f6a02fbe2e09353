// Making camera packets of rays that a caller has stored: whether they start at one point and lie
// nearly on a grid, and the frame of that grid.

#if defined(MORPHRAY_CPU_PACKET_CAMERA_STORED_PACKET_MAKER_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef MORPHRAY_CPU_PACKET_CAMERA_STORED_PACKET_MAKER_INL_H
#undef MORPHRAY_CPU_PACKET_CAMERA_STORED_PACKET_MAKER_INL_H
#else
#define MORPHRAY_CPU_PACKET_CAMERA_STORED_PACKET_MAKER_INL_H
#endif

#include <hwy/highway.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <glm/geometric.hpp>
#include <limits>

#include "common/scene/scene_space.h"
#include "cpu/packet/camera/camera_packet.h"
#include "cpu/packet/camera/camera_packet_maker-inl.h"
#include "cpu/packet/packet_frame-inl.h"
#include "cpu/simd/hit_rule-inl.h"

HWY_BEFORE_NAMESPACE();
namespace mray::cpu {
namespace HWY_NAMESPACE {

/// Whether stored rays have a packet: all start at the first one's origin, none has an interval,
/// and no direction is zero, infinite, NaN or below all normal floats.
///
/// A vector holds the two halves of some rays side by side: lane 2 i has (org, tnear) of ray i,
/// lane 2 i + 1 its (dir, tfar).
class StoredRayReader {
public:
    static constexpr std::size_t kRays = kLanes / 2;

    explicit StoredRayReader(const StoredRay& first)
        : is_dir_(mask_of(0xAAAAAAAAu & kLaneBits)), good_(mask_of(kLaneBits)) {
        for (int axis = 0; axis < 3; ++axis) org_[axis] = splat(first.org[axis]);
    }

    /// Reads kRays rays, and writes their canonical directions for each axis in lanes 2 i + 1 of
    /// out[axis].
    HWY_INLINE void read(const StoredRay* rays, float out[3][kMaxLanes]) {
        FloatVec v[3], end;
        hn::LoadInterleaved4(kFloats, rays->org, v[0], v[1], v[2], end);
        // A NaN compares as false.
        const Mask same_org =
            (v[0] == org_[0]) & (v[1] == org_[1]) & (v[2] == org_[2]) & (end <= zero());
        const FloatVec largest = max3(abs(v[0]), abs(v[1]), abs(v[2]));
        const FloatVec sum = abs(v[0]) + abs(v[1]) + abs(v[2]);
        const Mask good_dir = (largest >= splat(0x1p-126f)) & (sum <= splat(0x1p126f)) &
                              (end == splat(std::numeric_limits<float>::infinity()));
        good_ = good_ & ((is_dir_ & good_dir) | and_not(is_dir_, same_org));
        canonical_directions(v);
        for (int axis = 0; axis < 3; ++axis) store(v[axis], out[axis]);
    }

    bool good() const { return all(good_); }

private:
    Mask is_dir_;
    Mask good_;
    FloatVec org_[3];
};

/// Rays are prefetched this many rows ahead: processors do not foresee where a row of a tile
/// begins.
inline constexpr std::uint32_t kRowsAhead = 2;

/// Stores the canonical directions of the rays of a tile by camera_packet_ray(). Returns false if
/// the rays have no packet. width: a multiple of StoredRayReader::kRays.
HWY_INLINE bool store_directions(const StoredRayTile& tile, StoredDirections& out) {
    StoredRayReader reader(*tile.rays);
    alignas(64) float d[3][kMaxLanes];
    for (std::uint32_t y = 0; y < tile.height; ++y) {
        const StoredRay* const row = tile.rays + y * tile.stride;
        for (std::uint32_t x = 0; x < tile.width; x += StoredRayReader::kRays) {
            if (y + kRowsAhead < tile.height)
                prefetch(row + kRowsAhead * tile.stride + x,
                         StoredRayReader::kRays * sizeof(StoredRay));
            reader.read(row + x, d);
            for (std::uint32_t i = 0; i < StoredRayReader::kRays; ++i) {
                const std::uint32_t ray = camera_packet_ray(x + i, y);
                for (int axis = 0; axis < 3; ++axis) out.d[axis][ray] = d[axis][2 * i + 1];
            }
        }
        if (!reader.good()) return false;
    }
    return true;
}

/// Fits a grid, in a plane at distance 1, to the directions of a tile's corners: with positive
/// factors s, the points s[k] d[k] are a parallelogram, s[3] d[3] = s[1] d[1] + s[2] d[2] - s[0]
/// d[0]. Four directions of which no three lie in a plane have one, up to a common factor. Returns
/// whether they have. Nothing depends on how good it is: place_error_of() measures that.
HWY_INLINE bool fit_grid(const StoredDirections& directions, std::uint32_t width,
                         std::uint32_t height, PlaneAxes& axes) {
    const auto direction = [&](std::uint32_t x, std::uint32_t y) HWY_ATTR {
        const std::uint32_t ray = camera_packet_ray(x, y);
        return glm::dvec3(directions.d[0][ray], directions.d[1][ray], directions.d[2][ray]);
    };
    const glm::dvec3 d[4] = {direction(0, 0), direction(width - 1, 0), direction(0, height - 1),
                             direction(width - 1, height - 1)};
    // By Cramer's rule, times the determinant of d[0], d[1] and d[2], whose sign is that of all.
    const double s0 = -glm::dot(d[3], glm::cross(d[1], d[2]));
    const double s1 = glm::dot(d[3], glm::cross(d[2], d[0]));
    const double s2 = glm::dot(d[3], glm::cross(d[0], d[1]));
    const double sign = s0 < 0 ? -1 : 1;
    if (!(s0 * sign > 0 && s1 * sign > 0 && s2 * sign > 0)) return false;
    const glm::dvec3 origin = d[0] * (s0 * sign);
    const glm::dvec3 du = (d[1] * (s1 * sign) - origin) * (1.0 / (width - 1));
    const glm::dvec3 dv = (d[2] * (s2 * sign) - origin) * (1.0 / (height - 1));
    const glm::dvec3 normal = glm::cross(du, dv);
    const double distance = std::abs(glm::dot(normal, origin)) / glm::length(normal);
    if (!(distance > 0)) return false;
    axes.x = du * (1 / distance);
    axes.y = dv * (1 / distance);
    // The ray (0, 0) has the place (0.5, 0.5) - kCameraSide / 2 in the frame.
    constexpr double kFirst = 0.5 * kCameraSide - 0.5;
    axes.z = origin * (1 / distance) + (axes.x + axes.y) * kFirst;
    return true;
}

/// Rays may be farther from their places on the grid than camera rays, but a packet whose rays are
/// farther than this, in steps of the grid, leaves too much uncertain. It also keeps them within
/// the frame's reach, 33.
inline constexpr float kMostPlaceError = 0.5f;
/// The least z of a canonical direction in the frame.
inline constexpr double kLeastStoredZ = 0.25;

/// An upper bound of how far the rays of a tile are from their places on the grid, in steps of it;
/// kNoPixelError if a direction's z is too small.
///
/// 1. A ray with the direction d goes through x = (rows[0] d) / (rows[2] d); y likewise. With its
///    place X it is off by |rows[0] d - X (rows[2] d)| / (rows[2] d).
/// 2. The numerator a is computed in double. The magnitudes of its terms add up to 2 row_size[0]
///    and, as |X| < 33, to 66 row_size[2] (a canonical direction has components below 2): it is off
///    by at most kStoredPlaceRounding times these. Likewise z is off by 3 * 2^-53 of 2 row_size[2],
///    which is less than 0.01 % of kLeastStoredZ, since rows[2] has length 1.
/// 3. a / z is rounded to float and divided, off by less than 0.01 %, so that kWiden covers both.
HWY_INLINE float place_error_of(const PacketFrame& frame, const StoredDirections& directions,
                                std::uint32_t width, std::uint32_t height) {
    const hn::CappedTag<double, 8> doubles;
    using DoubleVec = hn::Vec<decltype(doubles)>;
    const hn::Rebind<float, decltype(doubles)> halves;
    const std::size_t lanes = hn::MaxLanes(doubles);
    DoubleVec rows[3][3];
    for (int k = 0; k < 3; ++k)
        for (int axis = 0; axis < 3; ++axis) rows[k][axis] = hn::Set(doubles, frame.rows[k][axis]);
    const auto along = [&](int k, const DoubleVec d[3]) HWY_ATTR {
        return hn::Add(hn::Add(hn::Mul(rows[k][0], d[0]), hn::Mul(rows[k][1], d[1])),
                       hn::Mul(rows[k][2], d[2]));
    };
    auto most = hn::Zero(halves);
    auto least_z = hn::Set(doubles, 1e30);
    const std::uint32_t columns = width / kBlockSide;
    for (std::uint32_t row = 0; row < height / kBlockSide; ++row) {
        for (std::uint32_t column = 0; column < columns; ++column) {
            const std::size_t block = (row * kGridSide + column) * kBlockRays;
            for (std::size_t l = 0; l < kBlockRays; l += lanes) {
                DoubleVec d[3];
                for (int axis = 0; axis < 3; ++axis) {
                    d[axis] =
                        hn::PromoteTo(doubles, hn::LoadU(halves, directions.d[axis] + block + l));
                }
                const auto x = hn::PromoteTo(doubles, hn::LoadU(halves, kGridRays.x[column] + l));
                const auto y = hn::PromoteTo(doubles, hn::LoadU(halves, kGridRays.y[row] + l));
                const auto z = along(2, d);
                least_z = hn::Min(least_z, z);
                const auto a = hn::Abs(hn::Sub(along(0, d), hn::Mul(x, z)));
                const auto b = hn::Abs(hn::Sub(along(1, d), hn::Mul(y, z)));
                most = hn::Max(
                    most, hn::Div(hn::DemoteTo(halves, hn::Max(a, b)), hn::DemoteTo(halves, z)));
            }
        }
    }
    const double z = hn::GetLane(hn::MinOfLanes(doubles, least_z));
    if (!(z > kLeastStoredZ) || !(frame.row_size[2] < 2)) return kNoPixelError;
    const double rounding =
        kStoredPlaceRounding *
        (2 * std::max(frame.row_size[0], frame.row_size[1]) + 66 * frame.row_size[2]) / z;
    return static_cast<float>(
        kWiden * (static_cast<double>(hn::GetLane(hn::MaxOfLanes(halves, most))) + rounding));
}

/// Makes a packet of stored rays, but for their depths, from `directions`, which it fills. Returns
/// false if they have none.
HWY_INLINE bool frame_stored_packet(const StoredRayTile& tile, StoredDirections& directions,
                                    CameraPacket& packet) {
    PlaneAxes axes;
    if (!store_directions(tile, directions)) return false;
    if (!fit_grid(directions, tile.width, tile.height, axes)) return false;
    CameraFrame& frame = packet.frame;
    set_frame(frame, tile.org, axes, 0.5f * kCameraSide + 1);
    frame.ray_error = place_error_of(frame, directions, tile.width, tile.height);
    if (!(frame.ray_error <= kMostPlaceError)) return false;
    packet.stored = &directions;
    start_blocks(tile.width, tile.height, packet);
    set_wedges(frame, axes);
    return true;
}

}  // namespace HWY_NAMESPACE
}  // namespace mray::cpu
HWY_AFTER_NAMESPACE();

#endif
