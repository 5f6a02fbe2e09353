// Finishes a camera packet: t, u and v of each closest candidate by the hit rule, many rays at a
// time.

#if defined(MORPHRAY_CPU_PACKET_CAMERA_CAMERA_PACKET_FINISH_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef MORPHRAY_CPU_PACKET_CAMERA_CAMERA_PACKET_FINISH_INL_H
#undef MORPHRAY_CPU_PACKET_CAMERA_CAMERA_PACKET_FINISH_INL_H
#else
#define MORPHRAY_CPU_PACKET_CAMERA_CAMERA_PACKET_FINISH_INL_H
#endif

#include <hwy/highway.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "cpu/packet/camera/camera_packet.h"
#include "cpu/packet/camera/camera_packet_candidates-inl.h"
#include "cpu/packet/camera/camera_packet_maker-inl.h"
#include "cpu/simd/hit_rule-inl.h"

HWY_BEFORE_NAMESPACE();
namespace mray::cpu {
namespace HWY_NAMESPACE {

/// Hits, a lane each.
struct HitLanes {
    FloatVec t, u, v;
    UintVec prim_ids;
};

HWY_INLINE HitLanes no_hits() {
    const FloatVec none = zero();
    return {none, none, none, splat(kNoPrim)};
}

/// Writes the hits of a packet whose rays have found their closest candidates.
class CameraPacketFinish {
public:
    /// rows: receives the pixels of the packet's blocks, row by row.
    CameraPacketFinish(const CameraPacket& packet, Hit* rows, std::size_t stride)
        : packet_(packet), rows_(rows), stride_(stride), camera_(packet.camera) {
        const CameraFrame& frame = packet.frame;
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
        if (!one_scale_) return;
        for (std::uint32_t k = 0; k < 3; ++k) {
            camera_.corner[k] *= scale;
            camera_.du[k] *= scale;
            camera_.dv[k] *= scale;
        }
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
    /// The rule's depth_slack, as in shear_ray.
    float depth_slack() const { return 0.25f * packet_.frame.depth_margin; }

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
        const float middle = camera_.corner[k] + camera_.du[k] * (camera_.first_x + kHalf) +
                             camera_.dv[k] * (camera_.first_y + kHalf);
        const float spread = (kHalf + 1) * (std::abs(camera_.du[k]) + std::abs(camera_.dv[k]));
        const float rounding =
            kRounding * (std::abs(camera_.corner[k]) + std::abs(camera_.du[k] * camera_.first_x) +
                         std::abs(camera_.dv[k] * camera_.first_y) + spread);
        return std::abs(middle) - spread - rounding;
    }

    /// Sets columns_: corner + du x of each column's rays.
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

    /// Sets the parts of a row of blocks' directions that dir() adds up. They are
    /// canonical_direction() of camera_direction() in their operations, except for the common sign.
    /// With one_scale_ the scale is in the camera's vectors already, which changes no bit, and no
    /// component is so small that it must be put on the grid.
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

    /// Component k of the directions of as many rays from `first` on as there are lanes. The row of
    /// camera rays is that of point_row().
    template <bool kStored>
    HWY_INLINE FloatVec dir(int k, std::size_t first) const {
        if constexpr (kStored) return load(stored_[k] + first) ^ splat(sign_);
        const std::size_t in_row = first % kRowRays;
        const float* const parts = one_scale_ ? columns_[k] : scaled_[k];
        return load(parts + in_row) + load(row_[k] + in_row % kBlockRays);
    }

    static HWY_INLINE FloatVec pixel(const float* offsets, float first) {
        // The sum of the packet's middle, the offset of its first pixel and the pixel's own.
        constexpr float kMiddle = 0.5f * kCameraSide - 0.5f;
        return load(offsets) + splat(first + kMiddle) + splat(0.5f);
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
                    write(no_hits(), place(first));
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
        const FloatVec slack = splat(depth_slack());
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
        const Mask is_fast = fast.project(directions, slack, corners);
        return is_fast & mask_of(one_axis && one_sign ? ~0u : 0u);
    }

    /// Writes the hits for which the rule takes its fast path. The others become fallback rays,
    /// whatever is written for them here.
    HWY_INLINE void finish_hits(const BegunHits& rays) {
        const Mask has_candidate = mask_of(rays.rays);
        // A mask as a vector, not a constant of all ones: compilers compare a register with itself
        // to make one, and each iteration would wait for the last use of that register.
        const UintVec no_prim = as_uint(hn::VecFromMask(kFloats, !has_candidate));
        FloatVec t, u, v;
        const FloatVec z = rays.fast.weigh(t, u, v);
        write({zero_unless(has_candidate, t), zero_unless(has_candidate, u),
               zero_unless(has_candidate, v), rays.prim_ids | no_prim},
              place(rays.first));
        std::uint32_t rest = rays.rays & ~bits_of(rays.is_fast & rays.fast.is_ahead);
        if (HWY_LIKELY(rest == 0)) return;
        const Mask is_hit_ahead = rays.fast.is_hit_ahead(z, splat(depth_slack()));
        for (rest &= ~bits_of(rays.is_fast & is_hit_ahead); rest != 0; rest &= rest - 1) {
            fallback_[fallback_count_++] = static_cast<std::uint16_t>(
                rays.first + static_cast<std::size_t>(__builtin_ctz(rest)));
        }
    }

    /// Writes the hits of the fallback rays, by the whole rule.
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
            FloatVec dir[3];
            directions_of(packet_, load(rays), dir);
            lanes::TriangleHit hit;
            const lanes::ShearedRay sheared =
                lanes::shear_ray(lanes::Float3(packet_.frame.org), lanes::Float3(dir));
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
    /// The packet's camera, rotated for its axis if it has one, with positive largest components.
    CameraRays camera_;
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
    std::uint16_t fallback_[kCameraRays];
    std::size_t fallback_count_ = 0;
};

}  // namespace HWY_NAMESPACE
}  // namespace mray::cpu
HWY_AFTER_NAMESPACE();

#endif
