// The rays of a camera packet: the frame of a tile of camera rays; that of rays that a caller has
// stored, if they lie nearly on a grid; and in the end t, u and v of each closest candidate.
#include <algorithm>
#include <bit>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>

#include "common/scene/scene_space.h"
#include "cpu/packet/camera_candidates-inl.h"
#include "cpu/packet/packet_plane-inl.h"
#include "cpu/simd/triangle_plane-inl.h"

HWY_BEFORE_NAMESPACE();
namespace mray::cpu::HWY_NAMESPACE {

// ---- Camera rays

/// The limits of a usable frame: rays are off by at most kMostPixelError pixels (TriangleSetup
/// assumes |X|, |Y| <= reach, which has room for them), directions by less than kMostDepthError of
/// themselves along z, and row_size[2] times a direction is below kMostOblique
/// (lab/proofs/packet_volume.g).
inline constexpr double kMostPixelError = 2;
inline constexpr double kMostDepthError = 0.5;
inline constexpr double kMostOblique = 0x1p18;

/// Stands for an error without a bound. Such rays have no packet: their z might not be above 0.
inline constexpr float kNoPixelError = 1e30f;

/// An upper bound of how far a camera ray may be from the middle of its pixel, in pixels;
/// kNoPixelError if the tile's rays are too inexact or too oblique for the bounds, or lie in one
/// plane (docs/design/arithmetic.md, "Packets", step 6).
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
    for (std::uint32_t row = 0; row < frame.grid_rows; ++row)
        std::fill_n(packet.block_q + row * kGridSide, frame.grid_columns, 0.0f);
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
    packet.stored = nullptr;
    packet.camera = camera;
    packet.first_x = tile.x0;
    packet.first_y = tile.y0;
    start_blocks(tile.x1 - tile.x0, tile.y1 - tile.y0, packet);
    set_wedges(frame, axes);
    return true;
}

/// Resets the rays of a packet whose frame is set: no candidate, any depth.
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

// ---- Stored rays

/// Rays are prefetched this many rows ahead: processors do not foresee where a row of a tile
/// begins.
inline constexpr std::uint32_t kRowsAhead = 2;

/// Stores the canonical directions of the rays of a tile by camera_packet_ray(). Returns false if
/// the rays have no packet: not all start at the first one's origin without an interval, or a
/// direction is zero, infinite, NaN or below all normal floats. width: a multiple of kLanes / 2.
HWY_INLINE bool store_directions(const StoredRayTile& tile, StoredDirections& out) {
    // A vector holds the two halves of some rays side by side: lane 2 i has (org, tnear) of ray i,
    // lane 2 i + 1 its (dir, tfar).
    constexpr std::uint32_t kRays = kLanes / 2;
    const Mask is_dir = mask_of(0xAAAAAAAAu & kLaneBits);
    const float* const first = tile.rays->org;
    const FloatVec org[3] = {splat(first[0]), splat(first[1]), splat(first[2])};
    Mask good = mask_of(kLaneBits);
    for (std::uint32_t y = 0; y < tile.height; ++y) {
        const StoredRay* const row = tile.rays + y * tile.stride;
        for (std::uint32_t x = 0; x < tile.width; x += kRays) {
            if (y + kRowsAhead < tile.height)
                prefetch(row + kRowsAhead * tile.stride + x, kRays * sizeof(StoredRay));
            FloatVec v[3], end;
            hn::LoadInterleaved4(kFloats, row[x].org, v[0], v[1], v[2], end);
            // A NaN compares as false.
            const Mask same_org =
                (v[0] == org[0]) & (v[1] == org[1]) & (v[2] == org[2]) & (end <= zero());
            const FloatVec largest = max3(abs(v[0]), abs(v[1]), abs(v[2]));
            const FloatVec sum = abs(v[0]) + abs(v[1]) + abs(v[2]);
            const Mask good_dir = (largest >= splat(0x1p-126f)) & (sum <= splat(0x1p126f)) &
                                  (end == splat(std::numeric_limits<float>::infinity()));
            good = good & ((is_dir & good_dir) | and_not(is_dir, same_org));
            alignas(64) float d[3][kMaxLanes];
            store3(lanes::canonical_direction(lanes::Float3(v)), d, 0);
            for (std::uint32_t i = 0; i < kRays; ++i) {
                const std::uint32_t ray = camera_packet_ray(x + i, y);
                for (int axis = 0; axis < 3; ++axis) out.d[axis][ray] = d[axis][2 * i + 1];
            }
        }
        if (!all(good)) return false;
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

/// A packet whose rays are farther from their places than this, in steps of the grid, leaves too
/// much uncertain. It also keeps them within the frame's reach, 33.
inline constexpr float kMostPlaceError = 0.5f;
/// The least z of a canonical direction in the frame.
inline constexpr double kLeastStoredZ = 0.25;

/// An upper bound of how far the rays of a tile are from their places on the grid, in steps of it;
/// kNoPixelError if a direction's z is too small (docs/design/arithmetic.md, "Packets", step 6).
HWY_INLINE float place_error_of(const PacketFrame& frame, const StoredDirections& directions,
                                std::uint32_t width, std::uint32_t height) {
    const std::size_t lanes = hn::MaxLanes(kDoubles);
    DoubleVec rows[3][3];
    for (int k = 0; k < 3; ++k)
        for (int axis = 0; axis < 3; ++axis) rows[k][axis] = hn::Set(kDoubles, frame.rows[k][axis]);
    const auto along = [&](int k, const DoubleVec d[3]) HWY_ATTR {
        return hn::Add(hn::Add(hn::Mul(rows[k][0], d[0]), hn::Mul(rows[k][1], d[1])),
                       hn::Mul(rows[k][2], d[2]));
    };
    auto most = hn::Zero(kHalves);
    auto least_z = hn::Set(kDoubles, 1e30);
    const std::uint32_t columns = width / kBlockSide;
    for (std::uint32_t row = 0; row < height / kBlockSide; ++row) {
        for (std::uint32_t column = 0; column < columns; ++column) {
            const std::size_t block = (row * kGridSide + column) * kBlockRays;
            for (std::size_t l = 0; l < kBlockRays; l += lanes) {
                DoubleVec d[3];
                for (int axis = 0; axis < 3; ++axis) {
                    d[axis] =
                        hn::PromoteTo(kDoubles, hn::LoadU(kHalves, directions.d[axis] + block + l));
                }
                const auto x = hn::PromoteTo(kDoubles, hn::LoadU(kHalves, kGrid.x[column] + l));
                const auto y = hn::PromoteTo(kDoubles, hn::LoadU(kHalves, kGrid.y[row] + l));
                const auto z = along(2, d);
                least_z = hn::Min(least_z, z);
                const auto a = hn::Abs(hn::Sub(along(0, d), hn::Mul(x, z)));
                const auto b = hn::Abs(hn::Sub(along(1, d), hn::Mul(y, z)));
                most = hn::Max(
                    most, hn::Div(hn::DemoteTo(kHalves, hn::Max(a, b)), hn::DemoteTo(kHalves, z)));
            }
        }
    }
    const double z = hn::GetLane(hn::MinOfLanes(kDoubles, least_z));
    if (!(z > kLeastStoredZ) || !(frame.row_size[2] < 2)) return kNoPixelError;
    const double rounding =
        kStoredPlaceRounding *
        (2 * std::max(frame.row_size[0], frame.row_size[1]) + 66 * frame.row_size[2]) / z;
    return static_cast<float>(
        kWiden * (static_cast<double>(hn::GetLane(hn::MaxOfLanes(kHalves, most))) + rounding));
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

// ---- Hits

struct HitLanes {
    FloatVec t, u, v;
    UintVec prim_ids;
};

/// Writes the hits of a packet whose rays have found their closest candidates.
class CameraPacketFinish {
public:
    /// rows: receives the pixels of the packet's blocks, row by row.
    CameraPacketFinish(const CameraPacket& packet, Hit* rows, std::size_t stride)
        : packet_(packet), rows_(rows), stride_(stride), camera_(packet.camera) {
        const CameraFrame& frame = packet.frame;
        std::fill_n(plane_candidates_, kPlanes, kNoCandidate);
        if (packet.stored != nullptr)
            for (int k = 0; k < 3; ++k) stored_[k] = packet.stored->d[k];
        if (frame.axis == kMixedAxes) return;
        // All largest components have the sign of the middle ray's; they become positive.
        const float sign = frame.axis_sign;
        if (packet.stored != nullptr) {
            sign_ = sign < 0 ? -0.0f : 0.0f;
            for (std::uint32_t k = 0; k < 3; ++k)
                stored_[k] = packet.stored->d[(frame.axis + 1 + k) % 3];
            return;
        }
        const float scale = mray::scale_to_unit(frame.depth_least);
        one_scale_ = scale == mray::scale_to_unit(frame.depth_most);
        for (std::uint32_t k = 0; k < 3; ++k) {
            const std::uint32_t axis = (frame.axis + 1 + k) % 3;
            camera_.corner[k] = sign * packet.camera.corner[axis];
            camera_.du[k] = sign * packet.camera.du[axis];
            camera_.dv[k] = sign * packet.camera.dv[axis];
            one_scale_ = one_scale_ && least_size(k) * scale >= 2 * kDirectionOnGrid;
        }
        for (vec3* v : {&camera_.corner, &camera_.du, &camera_.dv})
            if (one_scale_) *v *= scale;
    }

    void run() {
        const bool mixed = packet_.frame.axis == kMixedAxes;
        if (packet_.stored != nullptr) {
            mixed ? finish_all<true, true>() : finish_all<false, true>();
        } else {
            point_columns();
            mixed ? finish_all<true, false>() : finish_all<false, false>();
        }
        if (HWY_UNLIKELY(fallback_count_ != 0)) finish_fallback();
    }

private:
    static constexpr std::size_t kRowRays = kGridSide * kBlockRays;

    Hit* place(std::size_t ray) const {
        const std::size_t block = ray / kBlockRays;
        const std::size_t x = block % kGridSide * kBlockSide + ray % kBlockRays / kBlockSide;
        const std::size_t y = block / kGridSide * kBlockSide + ray % kBlockSide;
        return rows_ + y * stride_ + x;
    }

    /// Prefetches the memory of a block's hits. A row of an image is as far from the next as the
    /// image is wide, so that processors do not foresee where hits are written.
    HWY_INLINE void prefetch_block(std::size_t block) const {
        const Hit* const hits = place(block * kBlockRays);
        for (std::uint32_t y = 0; y < kBlockSide; ++y) __builtin_prefetch(hits + y * stride_, 1);
    }

    /// A lower bound of the magnitude of component k of the directions, before they are scaled.
    /// kRounding covers the roundings of `middle` and `spread`, each of at most 2^-24 of a term.
    float least_size(std::uint32_t k) const {
        constexpr float kHalf = 0.5f * kCameraSide;
        constexpr float kRounding = 0x1p-20f;
        const auto x = static_cast<float>(packet_.first_x);
        const auto y = static_cast<float>(packet_.first_y);
        const float middle =
            camera_.corner[k] + camera_.du[k] * (x + kHalf) + camera_.dv[k] * (y + kHalf);
        const float spread = (kHalf + 1) * (std::abs(camera_.du[k]) + std::abs(camera_.dv[k]));
        const float rounding =
            kRounding * (std::abs(camera_.corner[k]) + std::abs(camera_.du[k] * x) +
                         std::abs(camera_.dv[k] * y) + spread);
        return std::abs(middle) - spread - rounding;
    }

    /// Sets columns_: corner + du x of each column's rays.
    void point_columns() {
        for (std::uint32_t column = 0; column < kGridSide; ++column) {
            for (std::size_t l = 0; l < kBlockRays; l += kLanes) {
                const FloatVec x = pixel(kGrid.x[column] + l, packet_.first_x);
                for (int k = 0; k < 3; ++k) {
                    const FloatVec part = splat(camera_.du[k]) * x;
                    store(splat(camera_.corner[k]) + part, columns_[k] + column * kBlockRays + l);
                }
            }
        }
    }

    /// Sets the parts of a row of blocks' directions that dir() adds up. They are
    /// canonical_direction() of camera_direction() in their operations, except for the common sign.
    /// With one_scale_ the scale is in the camera's vectors already, which changes no bit, and no
    /// component is so small that it must be put on the grid.
    HWY_INLINE void point_row(std::size_t row) {
        for (std::size_t l = 0; l < kBlockRays; l += kLanes) {
            const FloatVec y = pixel(kGrid.y[row] + l, packet_.first_y);
            FloatVec part[3];
            for (int k = 0; k < 3; ++k) part[k] = splat(camera_.dv[k]) * y;
            if (HWY_LIKELY(one_scale_)) {
                for (int k = 0; k < 3; ++k) store(part[k], row_[k] + l);
                continue;
            }
            for (int k = 0; k < 3; ++k) store(zero(), row_[k] + l);
            for (std::size_t r = l; r < kRowRays; r += kBlockRays) {
                FloatVec d[3];
                for (int k = 0; k < 3; ++k) d[k] = load(columns_[k] + r) + part[k];
                store3(lanes::canonical_direction(lanes::Float3(d)), scaled_, r);
            }
        }
    }

    /// Component k of the directions of as many rays from `first` on as there are lanes. The row of
    /// camera rays is that of point_row().
    template <bool kStored>
    HWY_INLINE FloatVec dir(int k, std::size_t first) const {
        if constexpr (kStored) return load(stored_[k] + first) ^ splat(sign_);
        const std::size_t in_row = first % kRowRays;
        const float* const parts = one_scale_ ? columns_[k] : scaled_[k];
        return load(parts + in_row) + load(row_[k] + in_row % kBlockRays);
    }

    static HWY_INLINE FloatVec pixel(const float* offsets, std::uint32_t first) {
        // The sum of the packet's middle, the offset of its first pixel and the pixel's own.
        constexpr float kMiddle = 0.5f * kCameraSide - 0.5f;
        return load(offsets) + splat(static_cast<float>(first) + kMiddle) + splat(0.5f);
    }

    /// Writes the hits of some columns of a block, whose four rows are side by side in `hits`.
    HWY_INLINE void write(const HitLanes& hits, Hit* out) const {
        const FloatVec prim_ids = as_float(hits.prim_ids);
#if HWY_TARGET == HWY_SCALAR
        hn::StoreInterleaved4(hits.t, hits.u, hits.v, prim_ids, kFloats, &out->t);
#else
        static_assert(kBlockSide == 4 && sizeof(Hit) == 16);
        const FloatVec tv0 = hn::InterleaveLower(kFloats, hits.t, hits.v);
        const FloatVec tv2 = hn::InterleaveUpper(kFloats, hits.t, hits.v);
        const FloatVec ui0 = hn::InterleaveLower(kFloats, hits.u, prim_ids);
        const FloatVec ui2 = hn::InterleaveUpper(kFloats, hits.u, prim_ids);
        store_unaligned(hn::InterleaveLower(kFloats, tv0, ui0), &out[0 * stride_].t);
        store_unaligned(hn::InterleaveUpper(kFloats, tv0, ui0), &out[1 * stride_].t);
        store_unaligned(hn::InterleaveLower(kFloats, tv2, ui2), &out[2 * stride_].t);
        store_unaligned(hn::InterleaveUpper(kFloats, tv2, ui2), &out[3 * stride_].t);
#endif
    }

    /// As many rays as there are lanes, from `first` on, whose hits are begun.
    struct BegunHits {
        FastHits fast;
        UintVec prim_ids;
        Mask is_fast;  // the rule takes its fast path if the sign of z is certain
        std::size_t first;
        std::uint32_t rays;  // those with a candidate, as bits
    };

    /// Finishes all rays. kMixed: the packet's axis is kMixedAxes. kStored: it has stored
    /// directions.
    ///
    /// Each vector of rays is one long chain of dependent operations, too long for a processor to
    /// overlap several. So where registers allow it, begin_hits() of a vector is interleaved with
    /// finish_hits() of the vector before.
    template <bool kMixed, bool kStored>
    void finish_all() {
        constexpr bool kByHalves = kLanes == kBlockRays;
        const std::size_t row_rays = packet_.frame.grid_columns * kBlockRays;
        Candidates candidates = find_candidates(packet_.candidate);
        BegunHits before;
        before.rays = 0;
        for (std::size_t row = 0; row < packet_.frame.grid_rows; ++row) {
            if (!kStored) point_row(row);
            const std::size_t begin = row * kRowRays;
            for (std::size_t first = begin; first < begin + row_rays; first += kLanes) {
                // The candidates of the next rays are found before these are finished, because
                // branches and addresses wait long for the bits of a mask.
                const std::size_t after = first + kLanes;
                const std::size_t next =
                    after < begin + row_rays ? after : (begin + kRowRays) % kCameraRays;
                const Candidates next_candidates = find_candidates(packet_.candidate + next);
                if (!kStored && first % kBlockRays == 0 && row + 1 < packet_.frame.grid_rows)
                    prefetch_block(first / kBlockRays + kGridSide);
                BegunHits now;
                now.first = first;
                now.rays = candidates.rays;
                if (candidates.rays != 0) {
                    begin_hits<kMixed, kStored>(candidates, now);
                } else {
                    write({zero(), zero(), zero(), splat(kNoPrim)}, place(first));
                }
                if constexpr (kByHalves) {
                    if (HWY_LIKELY(before.rays != 0)) finish_hits(before);
                    before = now;
                } else {
                    if (HWY_LIKELY(now.rays != 0)) finish_hits(now);
                }
                candidates = next_candidates;
            }
        }
        if (kByHalves && before.rays != 0) finish_hits(before);
    }

    template <bool kMixed, bool kStored>
    HWY_INLINE void begin_hits(const Candidates& found, BegunHits& rays) const {
        const TriangleLanes candidates =
            spread_candidates(packet_, packet_.candidate + rays.first, found);
        const FloatVec d[3] = {dir<kStored>(0, rays.first), dir<kStored>(1, rays.first),
                               dir<kStored>(2, rays.first)};
        const FloatVec slack = splat(slack_);
        rays.prim_ids = candidates.prim_ids;
        rays.is_fast = kMixed ? project_mixed(d, slack, candidates, rays.fast)
                              : rays.fast.project(d, slack, candidates.corner);
    }

    /// Projects the candidates of a packet with mixed axes, for rays that have one axis and sign:
    /// nearly all neighbours do. The others count as not fast.
    HWY_INLINE Mask project_mixed(const FloatVec d[3], FloatVec slack,
                                  const TriangleLanes& candidates, FastHits& fast) const {
        const FloatVec size[3] = {abs(d[0]), abs(d[1]), abs(d[2])};
        const Mask is_x = (size[0] >= size[1]) & (size[0] >= size[2]);
        const Mask is_y = and_not(is_x, size[1] >= size[2]);
        const std::uint32_t axis = all(is_x) ? 0 : all(is_y) ? 1 : 2;
        const bool one_axis = axis != 2 || none(is_x | is_y);
        const Mask away = d[axis] < zero();
        const bool one_sign = all(away) || none(away);
        const FloatVec sign = d[axis] & splat(-0.0f);
        // The corners are rotated for axis 0.
        FloatVec directions[3], corners[3][3];
        for (std::uint32_t k = 0; k < 3; ++k) {
            directions[k] = d[(axis + 1 + k) % 3] ^ sign;
            for (int i = 0; i < 3; ++i) corners[i][k] = candidates.corner[i][(axis + k) % 3] ^ sign;
        }
        const Mask is_one = mask_of(one_axis && one_sign ? ~0u : 0u);
        const Mask is_fast = fast.project(directions, slack, corners) & is_one;
        fast.is_certain = fast.is_certain & is_one;
        return is_fast;
    }

    /// Writes the hits for which the rule takes its fast path. The others become fallback rays,
    /// whatever is written for them here.
    HWY_INLINE void finish_hits(const BegunHits& rays) {
        const Mask has_candidate = mask_of(rays.rays);
        // A mask as a vector, not a constant of all ones: compilers compare a register with itself
        // to make one, and each iteration would wait for the last use of that register.
        const UintVec no_prim = as_uint(hn::VecFromMask(kFloats, !has_candidate));
        lanes::TriangleHit hit;
        FastHits fast = rays.fast;
        fast.weigh(hit.t, hit.u, hit.v);
        const std::uint32_t rest =
            rays.rays & ~bits_of(rays.is_fast & fast.is_surely_smooth(hit.t));
        if (HWY_UNLIKELY(rest != 0)) {
            Mask is_smooth, is_rough;
            fast.find_rough(hit.t, is_smooth, is_rough);
            const Mask ahead = rays.is_fast & fast.is_hit_ahead(splat(slack_));
            is_rough = (ahead & is_rough) | fast.is_surely_rough(hit.t);
            finish_rest(rays.first, rest & ~bits_of(ahead & is_smooth), bits_of(is_rough), hit);
        }
        write({zero_unless(has_candidate, hit.t), zero_unless(has_candidate, hit.u),
               zero_unless(has_candidate, hit.v), rays.prim_ids | no_prim},
              place(rays.first));
    }

    /// Refines hits among the rays `rest` from `first` on, of which these are rough for certain.
    /// The others become fallback rays, as where few are rough.
    HWY_NOINLINE void finish_rest(std::size_t first, std::uint32_t rest, std::uint32_t rough,
                                  lanes::TriangleHit& hit) {
        rough &= rest;
        if (static_cast<std::uint32_t>(std::popcount(rough)) * 2 >= kLanes)
            rest &= ~refine_rough(first, rough, hit);
        for (const std::uint32_t lane : BitsOf(rest))
            fallback_[fallback_count_++] = static_cast<std::uint16_t>(first + lane);
    }

    /// Refines hits of rough rays, and returns which. Neighbours have the same triangle, whose
    /// plane is found once.
    HWY_INLINE std::uint32_t refine_rough(std::size_t first, std::uint32_t rough,
                                          lanes::TriangleHit& hit) {
        const UintVec rays = hn::Iota(kUints, static_cast<std::uint32_t>(first));
        const UintVec candidates = load(packet_.candidate + first);
        const lanes::Float3 dir = directions_of(packet_, rays);
        std::uint32_t done = 0;
        while (rough != 0) {
            const std::uint32_t candidate = packet_.candidate[first + first_bit(rough)];
            const std::uint32_t asked = rough & bits_of(float_mask(candidates == splat(candidate)));
            const TrianglePlane& plane = plane_of(candidate);
            const auto of_all = [&](std::uint32_t) -> auto& { return plane; };
            lanes::TriangleHit refined;
            const Mask placed = place_hits(of_all, dir, asked, refined) & mask_of(asked);
            take_hits(placed, refined, hit);
            done |= bits_of(placed);
            rough &= ~asked;
        }
        return done;
    }

    HWY_INLINE const TrianglePlane& plane_of(std::uint32_t candidate) {
        const std::size_t at = candidate % kPlanes;
        if (plane_candidates_[at] != candidate) {
            plane_candidates_[at] = candidate;
            const Leaf& leaf = *packet_.hit_leaves[triangle_leaf(candidate)].leaf;
            const TriangleCorners t = corners_in_lanes(leaf, triangle_slot(candidate));
            planes_[at] =
                triangle_plane({lanes::Float3(packet_.frame.org), 0}, {t.a, 0}, {t.b, 0}, {t.c, 0});
        }
        return planes_[at];
    }

    HWY_NOINLINE void finish_fallback() const {
        for (std::size_t i = 0; i < fallback_count_; i += kLanes) {
            const std::size_t count = std::min<std::size_t>(kLanes, fallback_count_ - i);
            alignas(64) std::uint32_t rays[kLanes] = {};
            alignas(64) std::uint32_t candidates[kLanes] = {};
            for (std::size_t l = 0; l < count; ++l) {
                rays[l] = fallback_[i + l];
                candidates[l] = packet_.candidate[rays[l]];
            }
            const auto lanes = static_cast<std::uint32_t>((std::uint64_t{1} << count) - 1);
            const TriangleLanes triangles = candidate_triangles(packet_, candidates, lanes);
            lanes::TriangleHit hit;
            const lanes::ShearedRay sheared = lanes::shear_ray(lanes::Float3(packet_.frame.org),
                                                               directions_of(packet_, load(rays)));
            intersect_triangles(sheared, triangles, splat(kInfiniteT), lanes, hit);
            Hit hits[kLanes];
            hn::StoreInterleaved4(hit.t, hit.u, hit.v, as_float(triangles.prim_ids), kFloats,
                                  &hits->t);
            for (std::size_t l = 0; l < count; ++l) *place(fallback_[i + l]) = hits[l];
        }
    }

    const CameraPacket& packet_;
    Hit* rows_;
    std::size_t stride_;
    float slack_ = 0.25f * packet_.frame.depth_margin;
    /// The packet's camera, rotated for its axis if it has one, with positive largest components.
    Camera camera_;
    /// Stored directions, rotated likewise, and the sign bit that makes their largest components
    /// positive.
    const float* stored_[3] = {};
    float sign_ = 0;
    /// Whether one scale holds for all directions, and none has a component that is nearly 0.
    bool one_scale_ = false;
    alignas(64) float columns_[3][kRowRays];
    /// The parts of the current row of blocks.
    alignas(64) float row_[3][kBlockRays];
    alignas(64) float scaled_[3][kRowRays];
    /// Planes of candidates by their last bits.
    static constexpr std::size_t kPlanes = 16;
    TrianglePlane planes_[kPlanes];
    std::uint32_t plane_candidates_[kPlanes];
    std::uint16_t fallback_[kCameraRays];
    std::size_t fallback_count_ = 0;
};

}  // namespace mray::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
