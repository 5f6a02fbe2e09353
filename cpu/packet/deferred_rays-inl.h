// Closest hits that a packet's bounds leave uncertain, asked of the hit rule many at a time.

#if defined(MORPHRAY_CPU_PACKET_DEFERRED_RAYS_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef MORPHRAY_CPU_PACKET_DEFERRED_RAYS_INL_H
#undef MORPHRAY_CPU_PACKET_DEFERRED_RAYS_INL_H
#else
#define MORPHRAY_CPU_PACKET_DEFERRED_RAYS_INL_H
#endif

#include <hwy/highway.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "cpu/packet/camera_packet_maker-inl.h"
#include "cpu/packet/packet.h"
#include "cpu/packet/packet_blocks-inl.h"
#include "cpu/packet/packet_hit_rule-inl.h"
#include "cpu/simd/fast_hit_rule-inl.h"

HWY_BEFORE_NAMESPACE();
namespace morphray::cpu {
namespace HWY_NAMESPACE {

/// Pairs of a ray and a triangle that may be its closest hit, put off: a triangle that is uncertain
/// beats nothing and is beaten by nothing until the rule has said where it is hit. That is no
/// change of the answer, which is the least of all triangles in the rule's order: whatever has
/// been left out for sure was farther than something that is hit for sure.
class DeferredRays {
public:
    explicit DeferredRays(Packet& packet) : packet_(packet) {}

    /// Some of as many rays as there are lanes, from `first` on; the triangle is one of the
    /// packet's won leaves. Not while there are many().
    void add(std::size_t first, std::uint32_t lanes, std::uint32_t triangle) {
        for (; lanes != 0; lanes &= lanes - 1) {
            rays_[count_] = static_cast<std::uint32_t>(first) +
                            static_cast<std::uint32_t>(__builtin_ctz(lanes));
            triangles_[count_++] = triangle;
        }
    }

    bool many() const { return count_ >= kMany; }

    /// Asks the rule. Adds the blocks of which rays have won something.
    template <std::size_t kWords>
    void settle(BlockSet<kWords>& changed) {
        for (std::size_t first = 0; first < count_; first += kLanes)
            settle(first, std::min<std::size_t>(kLanes, count_ - first), changed);
        count_ = 0;
    }

private:
    static constexpr std::size_t kMany = 128;

    template <std::size_t kWords>
    void settle(std::size_t first, std::size_t count, BlockSet<kWords>& changed) {
        alignas(64) std::uint32_t rays[kLanes] = {};
        alignas(64) std::uint32_t triangles[kLanes] = {};
        alignas(64) std::uint32_t candidates[kLanes] = {};
        for (std::size_t l = 0; l < count; ++l) {
            rays[l] = rays_[first + l];
            triangles[l] = triangles_[first + l];
            candidates[l] = packet_.candidate[rays[l]];
        }
        FloatVec dir[3];
        directions_of(packet_.camera, load(rays), dir);
        const PacketRule rule(packet_.frame.org, dir);
        const auto lanes = static_cast<std::uint32_t>((std::uint64_t{1} << count) - 1);
        const TriangleLanes asked = winning_triangles(packet_, triangles, lanes);
        const FloatVec no_end = splat(kInfiniteT);
        lanes::TriangleHit hit;
        std::uint32_t hits = bits_of(rule.intersect(asked, no_end, lanes, hit));
        const UintVec none = splat(kNoCandidate);
        std::uint32_t rivals = hits & bits_of(float_mask(load(candidates) != none));
        alignas(64) float t[kLanes], best_t[kLanes], q[kLanes];
        alignas(64) std::uint32_t ids[kLanes], best_ids[kLanes];
        if (rivals != 0) {
            const TriangleLanes best = winning_triangles(packet_, candidates, rivals);
            lanes::TriangleHit best_hit;
            rule.intersect(best, no_end, rivals, best_hit);
            store(best_hit.t, best_t);
            store(best.prim_ids, best_ids);
        }
        FloatVec z = zero();  // of the directions
        for (int axis = 0; axis < 3; ++axis)
            z = mul_add(splat(packet_.frame.rows_f[2][axis]), dir[axis], z);
        store(hit.t, t);
        store(asked.prim_ids, ids);
        store(splat(1.0f) / (hit.t * z), q);
        for (; hits != 0; hits &= hits - 1) {
            const auto l = static_cast<std::uint32_t>(__builtin_ctz(hits));
            if ((rivals >> l & 1) != 0 && !is_closer(t[l], ids[l], best_t[l], best_ids[l]))
                continue;
            const std::uint32_t ray = rays[l];
            packet_.q_lower[ray] = q[l] * (1 - 0x1p-16f);
            packet_.q_upper[ray] = q[l] * (1 + 0x1p-16f);
            packet_.candidate[ray] = triangles[l];
            const std::uint32_t block = ray / kBlockRays;
            changed.words[block / 64] |= std::uint64_t{1} << block % 64;
            for (std::uint32_t later = hits & (hits - 1); later != 0; later &= later - 1) {
                const auto other = static_cast<std::uint32_t>(__builtin_ctz(later));
                if (rays[other] != ray) continue;
                rivals |= 1u << other;
                best_t[other] = t[l];
                best_ids[other] = ids[l];
            }
        }
    }

    Packet& packet_;
    std::size_t count_ = 0;
    std::uint32_t rays_[kMany + kLanes];
    std::uint32_t triangles_[kMany + kLanes];
};

}  // namespace HWY_NAMESPACE
}  // namespace morphray::cpu
HWY_AFTER_NAMESPACE();

#endif
