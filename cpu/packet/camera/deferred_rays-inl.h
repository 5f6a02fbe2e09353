// Closest hits of a camera packet that its bounds leave uncertain: deferred, and resolved by the
// hit rule many at a time.
#if defined(MORPHRAY_CPU_PACKET_CAMERA_DEFERRED_RAYS_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef MORPHRAY_CPU_PACKET_CAMERA_DEFERRED_RAYS_INL_H
#undef MORPHRAY_CPU_PACKET_CAMERA_DEFERRED_RAYS_INL_H
#else
#define MORPHRAY_CPU_PACKET_CAMERA_DEFERRED_RAYS_INL_H
#endif

#include <hwy/highway.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "cpu/packet/camera/camera_packet.h"
#include "cpu/packet/camera/camera_packet_blocks-inl.h"
#include "cpu/packet/camera/camera_packet_candidates-inl.h"
#include "cpu/packet/camera/camera_packet_maker-inl.h"
#include "cpu/simd/hit_rule-inl.h"

HWY_BEFORE_NAMESPACE();
namespace mray::cpu {
namespace HWY_NAMESPACE {

/// Deferred pairs of a ray and a triangle that may be its closest hit. Until the rule has said
/// where an uncertain triangle is hit, it neither displaces a candidate nor is displaced. The
/// result does not change: it is the least of all triangles in the rule's order, and each triangle
/// that was rejected for certain is farther than one that is hit for certain.
class DeferredRays {
public:
    explicit DeferredRays(CameraPacket& packet) : packet_(packet) {}

    /// Defers the rays `lanes` from `first` on with a triangle, given as a candidate. Requires
    /// !many().
    void add(std::size_t first, std::uint32_t lanes, std::uint32_t triangle) {
        for (; lanes != 0; lanes &= lanes - 1) {
            rays_[count_] = static_cast<std::uint32_t>(first) +
                            static_cast<std::uint32_t>(__builtin_ctz(lanes));
            triangles_[count_++] = triangle;
        }
    }

    bool many() const { return count_ >= kMany; }

    /// Resolves all deferred pairs by the rule. Adds to `changed` the blocks whose rays have new
    /// candidates.
    void resolve(BlockSet& changed) {
        for (std::size_t first = 0; first < count_; first += kLanes)
            resolve(first, std::min<std::size_t>(kLanes, count_ - first), changed);
        count_ = 0;
    }

private:
    static constexpr std::size_t kMany = 128;

    /// How far 1 / (t z) as computed here may be from that of the rule's hit, relative to it.
    ///
    /// 1. t and the direction are those of the rule's hit. Product and quotient round once each:
    ///    kHitDepthRounding.
    /// 2. z is a sum of three products with rows that are rounded to float: five roundings of terms
    ///    whose magnitudes add up to at most row_size[2] times the direction's largest component.
    ///    For a direction of z = 1 that is at most row_size[2] depth_most, so z is off by at most
    ///    z_error of itself.
    /// 3. An error of e of z is one of e / (1 - e) of 1 / z, at most 2 e; from 1/2 on, nothing is
    ///    known.
    static float hit_depth_error(const PacketFrame& frame) {
        const float z_error = kHitDotRounding * frame.row_size[2] * frame.depth_most;
        return z_error < 0.5f ? 2 * (kHitDepthRounding + z_error) : kUnknown;
    }

    /// As many pairs as there are lanes, and what the rule says of them.
    struct Batch {
        alignas(64) std::uint32_t rays[kLanes] = {};
        alignas(64) std::uint32_t triangles[kLanes] = {};
        alignas(64) std::uint32_t candidates[kLanes] = {};
        alignas(64) float t[kLanes], best_t[kLanes], q[kLanes];
        float q_error;  // hit_depth_error()
        alignas(64) std::uint32_t ids[kLanes], best_ids[kLanes];
        /// The pairs that hit, and those of them whose ray has another candidate.
        std::uint32_t hits, rivals;
    };

    void resolve(std::size_t first, std::size_t count, BlockSet& changed) {
        Batch batch;
        batch.q_error = hit_depth_error(packet_.frame);
        for (std::size_t l = 0; l < count; ++l) {
            batch.rays[l] = rays_[first + l];
            batch.triangles[l] = triangles_[first + l];
            batch.candidates[l] = packet_.candidate[batch.rays[l]];
        }
        ask_rule(count, batch);
        take_closest(batch, changed);
    }

    HWY_INLINE void ask_rule(std::size_t count, Batch& batch) const {
        FloatVec dir[3];
        directions_of(packet_, load(batch.rays), dir);
        const lanes::ShearedRay rays =
            lanes::shear_ray(lanes::Float3(packet_.frame.org), lanes::Float3(dir));
        const auto lanes = static_cast<std::uint32_t>((std::uint64_t{1} << count) - 1);
        const TriangleLanes triangles = candidate_triangles(packet_, batch.triangles, lanes);
        const FloatVec no_end = splat(kInfiniteT);
        lanes::TriangleHit hit;
        batch.hits = bits_of(intersect_triangles(rays, triangles, no_end, lanes, hit));
        const UintVec none = splat(kNoCandidate);
        batch.rivals = batch.hits & bits_of(float_mask(load(batch.candidates) != none));
        if (batch.rivals != 0) {
            const TriangleLanes best = candidate_triangles(packet_, batch.candidates, batch.rivals);
            lanes::TriangleHit best_hit;
            intersect_triangles(rays, best, no_end, batch.rivals, best_hit);
            store(best_hit.t, batch.best_t);
            store(best.prim_ids, batch.best_ids);
        }
        FloatVec z = zero();  // of the directions
        for (int axis = 0; axis < 3; ++axis)
            z = mul_add(splat(packet_.frame.rows_f[2][axis]), dir[axis], z);
        store(hit.t, batch.t);
        store(triangles.prim_ids, batch.ids);
        store(splat(1.0f) / (hit.t * z), batch.q);
    }

    /// Makes the hits that are closer than their ray's candidate its candidate. A ray may have
    /// several pairs in the batch.
    HWY_INLINE void take_closest(Batch& batch, BlockSet& changed) {
        for (std::uint32_t hits = batch.hits; hits != 0; hits &= hits - 1) {
            const auto l = static_cast<std::uint32_t>(__builtin_ctz(hits));
            if ((batch.rivals >> l & 1) != 0 &&
                !is_closer(batch.t[l], batch.ids[l], batch.best_t[l], batch.best_ids[l]))
                continue;
            const std::uint32_t ray = batch.rays[l];
            packet_.q_lower[ray] = std::max(batch.q[l] * (1 - batch.q_error), 0.0f);
            packet_.q_upper[ray] = std::min(batch.q[l] * (1 + batch.q_error), kAnyDepth);
            packet_.candidate[ray] = batch.triangles[l];
            const std::uint32_t block = ray / kBlockRays;
            changed.words[block / 64] |= std::uint64_t{1} << block % 64;
            for (std::uint32_t later = hits & (hits - 1); later != 0; later &= later - 1) {
                const auto other = static_cast<std::uint32_t>(__builtin_ctz(later));
                if (batch.rays[other] != ray) continue;
                batch.rivals |= 1u << other;
                batch.best_t[other] = batch.t[l];
                batch.best_ids[other] = batch.ids[l];
            }
        }
    }

    CameraPacket& packet_;
    std::size_t count_ = 0;
    std::uint32_t rays_[kMany + kLanes];
    std::uint32_t triangles_[kMany + kLanes];
};

}  // namespace HWY_NAMESPACE
}  // namespace mray::cpu
HWY_AFTER_NAMESPACE();

#endif  // per target
