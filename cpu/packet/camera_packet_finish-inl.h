// The end of a closest-hit packet: t, u and v of each candidate by the hit rule, for many rays at
// once.

#if defined(MORPHRAY_CPU_PACKET_CAMERA_PACKET_FINISH_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef MORPHRAY_CPU_PACKET_CAMERA_PACKET_FINISH_INL_H
#undef MORPHRAY_CPU_PACKET_CAMERA_PACKET_FINISH_INL_H
#else
#define MORPHRAY_CPU_PACKET_CAMERA_PACKET_FINISH_INL_H
#endif

#include <hwy/highway.h>

#include <algorithm>
#include <cmath>

#include "cpu/packet/camera_packet_maker-inl.h"
#include "cpu/packet/hit_leaves-inl.h"
#include "cpu/packet/packet.h"
#include "cpu/packet/packet_hit_rule-inl.h"
#include "cpu/simd/fast_hit_rule-inl.h"

HWY_BEFORE_NAMESPACE();
namespace morphray::cpu {
namespace HWY_NAMESPACE {

/// Hits as vectors.
struct HitLanes {
    FloatVec t, u, v;
    UintVec prim_ids;
};

HWY_INLINE HitLanes no_hits() {
    const FloatVec none = zero();
    return {none, none, none, splat(kNoPrim)};
}

/// Writes the hits of a packet whose rays have found their candidates.
class PacketFinish {
public:
    /// rows: the pixels of the packet's blocks, row by row.
    PacketFinish(const Packet& packet, Hit* rows, std::size_t stride)
        : packet_(packet), rows_(rows), stride_(stride), camera_(packet.camera) {
        const PacketFrame& frame = packet.frame;
        if (frame.axis == kMixedAxes) return;
        // All largest components have the sign of the middle one's, and become positive.
        const float sign = frame.depth_rows[0][2] < 0 ? -1.0f : 1.0f;
        const float scale = morphray::scale_to_unit(frame.depth_least);
        one_scale_ = scale == morphray::scale_to_unit(frame.depth_most);
        for (std::uint32_t k = 0; k < 3; ++k) {
            const std::uint32_t axis = (frame.axis + 1 + k) % 3;
            camera_.corner[k] = sign * packet.camera.corner[axis];
            camera_.du[k] = sign * packet.camera.du[axis];
            camera_.dv[k] = sign * packet.camera.dv[axis];
            one_scale_ = one_scale_ && least_size(k) * scale >= 2 * kDirectionOnGrid;
        }
        if (!one_scale_) return;
        for (std::uint32_t k = 0; k < 3; ++k) {
            camera_.corner[k] *= scale;
            camera_.du[k] *= scale;
            camera_.dv[k] *= scale;
        }
    }

    void run() {
        point_columns();
        if (HWY_LIKELY(packet_.frame.axis != kMixedAxes)) {
            finish_all<false>();
        } else {
            finish_all<true>();
        }
        if (HWY_UNLIKELY(left_count_ != 0)) finish_left();
    }

private:
    static constexpr std::size_t kRowRays = kGridSide * kBlockRays;

    Hit* place(std::size_t ray) const {
        const std::size_t block = ray / kBlockRays;
        const std::size_t x = block % kGridSide * kBlockSide + ray % kBlockRays / kBlockSide;
        const std::size_t y = block / kGridSide * kBlockSide + ray % kBlockSide;
        return rows_ + y * stride_ + x;
    }

    /// A lower bound of the size of a component of the directions, before they are scaled.
    float least_size(std::uint32_t k) const {
        constexpr float kHalf = 0.5f * kCameraSide;
        const float middle = camera_.corner[k] + camera_.du[k] * (camera_.first_x + kHalf) +
                             camera_.dv[k] * (camera_.first_y + kHalf);
        const float spread = (kHalf + 1) * (std::abs(camera_.du[k]) + std::abs(camera_.dv[k]));
        const float rounding =
            0x1p-20f * (std::abs(camera_.corner[k]) + std::abs(camera_.du[k] * camera_.first_x) +
                        std::abs(camera_.dv[k] * camera_.first_y) + spread);
        return std::abs(middle) - spread - rounding;
    }

    /// corner + du x of each column's rays.
    void point_columns() {
        for (std::uint32_t column = 0; column < kGridSide; ++column) {
            for (std::size_t l = 0; l < kBlockRays; l += kLanes) {
                const FloatVec x = pixel(kGridRays.x[column] + l, packet_.camera.first_x);
                for (int k = 0; k < 3; ++k) {
                    const FloatVec part = splat(camera_.du[k]) * x;
                    store(splat(camera_.corner[k]) + part, columns_[k] + column * kBlockRays + l);
                }
            }
        }
    }

    /// The parts of a row of blocks' directions that dir() adds up: camera_direction() and
    /// canonical_direction(), in their operations, but for the common sign. Where one scale holds
    /// for all rays it has been taken into the camera's vectors, which changes no bit; and what no
    /// direction has to be put on the grid for is left out.
    HWY_INLINE void point_row(std::size_t row) {
        for (std::size_t l = 0; l < kBlockRays; l += kLanes) {
            const FloatVec y = pixel(kGridRays.y[row] + l, packet_.camera.first_y);
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
                canonical_directions(d);
                for (int k = 0; k < 3; ++k) store(d[k], scaled_[k] + r);
            }
        }
    }

    /// A component of the directions of as many rays of the row as there are lanes.
    HWY_INLINE FloatVec dir(int k, std::size_t in_row) const {
        const float* const parts = one_scale_ ? columns_[k] : scaled_[k];
        return load(parts + in_row) + load(row_[k] + in_row % kBlockRays);
    }

    static HWY_INLINE FloatVec pixel(const float* offsets, float first) {
        // From the middle of the packet to its first pixel's, and to the pixel's own.
        constexpr float kMiddle = 0.5f * kCameraSide - 0.5f;
        return load(offsets) + splat(first + kMiddle) + splat(0.5f);
    }

    /// Writes the hits of some columns of a block from its first row on: four rows side by side.
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

    /// As many rays as there are lanes, from `first` on, on the way to their hits.
    struct BeginFinish {
        FastHits fast;
        UintVec prim_ids;
        Mask sufficed;
        std::size_t first;
        std::uint32_t rays;  // those that have a candidate, as bits
    };

    /// kMixed: the packet has no axis.
    ///
    /// To end a vector of rays is one long chain of operations, and a processor has no room for
    /// those of many at a time. So where registers allow it the first half of a chain is done
    /// together with the second half of the one before.
    template <bool kMixed>
    void finish_all() {
        constexpr bool kByHalves = kLanes == kBlockRays;
        const std::size_t row_rays = packet_.frame.grid_columns * kBlockRays;
        Candidates candidates = find_candidates(packet_.candidate);
        BeginFinish before;
        before.rays = 0;
        for (std::size_t row = 0; row < packet_.frame.grid_rows; ++row) {
            point_row(row);
            const std::size_t begin = row * kRowRays;
            for (std::size_t first = begin; first < begin + row_rays; first += kLanes) {
                // The candidates of the next rays are looked for before these are finished: masks
                // take long to get to where branches and addresses wait for them.
                const std::size_t after = first + kLanes;
                const std::size_t next =
                    after < begin + row_rays ? after : (begin + kRowRays) % kCameraRays;
                const Candidates next_candidates = find_candidates(packet_.candidate + next);
                BeginFinish now;
                now.first = first;
                now.rays = candidates.rays;
                if (candidates.rays != 0) {
                    begin_finish<kMixed>(candidates, now);
                } else {
                    write(no_hits(), place(first));
                }
                if constexpr (kByHalves) {
                    if (HWY_LIKELY(before.rays != 0)) end_finish(before);
                    before = now;
                } else {
                    if (HWY_LIKELY(now.rays != 0)) end_finish(now);
                }
                candidates = next_candidates;
            }
        }
        if (kByHalves && before.rays != 0) end_finish(before);
    }

    template <bool kMixed>
    HWY_INLINE void begin_finish(const Candidates& found, BeginFinish& rays) const {
        const std::size_t in_row = rays.first % kRowRays;
        const CandidateLanes candidates =
            spread_candidates(packet_, packet_.candidate + rays.first, found);
        const FloatVec d[3] = {dir(0, in_row), dir(1, in_row), dir(2, in_row)};
        const FloatVec slack = splat(0.25f * packet_.frame.dilation);
        rays.prim_ids = candidates.prim_ids;
        rays.sufficed = kMixed ? project_turned(d, slack, candidates, rays.fast)
                               : rays.fast.project(d, slack, candidates.corners);
    }

    /// In a packet of mixed axes nearly all neighbours still have one.
    HWY_INLINE Mask project_turned(const FloatVec d[3], FloatVec slack,
                                   const CandidateLanes& candidates, FastHits& fast) const {
        const FloatVec size[3] = {abs(d[0]), abs(d[1]), abs(d[2])};
        const Mask is_x = (size[0] >= size[1]) & (size[0] >= size[2]);
        const Mask is_y = and_not(is_x, size[1] >= size[2]);
        const std::uint32_t axis = all(is_x) ? 0 : all(is_y) ? 1 : 2;
        const bool one_axis = axis != 2 || none(is_x | is_y);
        const Mask away = d[axis] < zero();
        const bool one_sign = all(away) || none(away);
        const FloatVec sign = d[axis] & splat(-0.0f);
        // Corners are rotated for axis 0.
        FloatVec directions[3], corners[3][3];
        for (std::uint32_t k = 0; k < 3; ++k) {
            directions[k] = d[(axis + 1 + k) % 3] ^ sign;
            for (int i = 0; i < 3; ++i)
                corners[i][k] = candidates.corners[i][(axis + k) % 3] ^ sign;
        }
        const Mask sufficed = fast.project(directions, slack, corners);
        return sufficed & mask_of(one_axis && one_sign ? ~0u : 0u);
    }

    /// Writes those of these hits that the rule's plain path suffices for; the others are left.
    HWY_INLINE void end_finish(const BeginFinish& rays) {
        const Mask done = rays.sufficed & mask_of(rays.rays);
        // Not a constant of all ones, which compilers make from a register's old contents: then
        // each ray would wait for the last.
        const UintVec not_done = as_uint(hn::VecFromMask(kFloats, !done));
        FloatVec t, u, v;
        rays.fast.weigh(t, u, v);
        write({zero_unless(done, t), zero_unless(done, u), zero_unless(done, v),
               rays.prim_ids | not_done},
              place(rays.first));
        for (std::uint32_t left = rays.rays & ~bits_of(done); left != 0; left &= left - 1) {
            left_[left_count_++] = static_cast<std::uint16_t>(
                rays.first + static_cast<std::size_t>(__builtin_ctz(left)));
        }
    }

    /// The hits that are left, by the whole rule.
    HWY_NOINLINE void finish_left() const {
        for (std::size_t i = 0; i < left_count_; i += kLanes) {
            const std::size_t count = std::min<std::size_t>(kLanes, left_count_ - i);
            alignas(64) std::uint32_t rays[kLanes] = {};
            alignas(64) std::uint32_t candidates[kLanes] = {};
            for (std::size_t l = 0; l < count; ++l) {
                rays[l] = left_[i + l];
                candidates[l] = packet_.candidate[rays[l]];
            }
            const auto lanes = static_cast<std::uint32_t>((std::uint64_t{1} << count) - 1);
            const TriangleLanes triangles = winning_triangles(packet_, candidates, lanes);
            FloatVec dir[3];
            directions_of(packet_.camera, load(rays), dir);
            lanes::TriangleHit hit;
            PacketRule(packet_.frame.org, dir).intersect(triangles, splat(kInfiniteT), lanes, hit);
            Hit hits[kLanes];
            hn::StoreInterleaved4(hit.t, hit.u, hit.v, as_float(triangles.prim_ids), kFloats,
                                  &hits->t);
            for (std::size_t l = 0; l < count; ++l) *place(left_[i + l]) = hits[l];
        }
    }

    const Packet& packet_;
    Hit* rows_;
    std::size_t stride_;
    /// Rotated for the packet's axis, if it has one, and turned.
    CameraRays camera_;
    /// Whether one scale holds for all directions, and none has a component that is nearly 0.
    bool one_scale_ = false;
    alignas(64) float columns_[3][kRowRays];
    /// Of a row of blocks.
    alignas(64) float row_[3][kBlockRays];
    alignas(64) float scaled_[3][kRowRays];
    /// The rays that the plain path does not suffice for.
    std::uint16_t left_[kCameraRays];
    std::size_t left_count_ = 0;
};

}  // namespace HWY_NAMESPACE
}  // namespace morphray::cpu
HWY_AFTER_NAMESPACE();

#endif
