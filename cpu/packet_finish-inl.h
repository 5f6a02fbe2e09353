// The end of a closest-hit packet: t, u and v of each winner by the hit rule, for many rays at
// once.

#if defined(MORPHRAY_PACKET_FINISH_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef MORPHRAY_PACKET_FINISH_INL_H
#undef MORPHRAY_PACKET_FINISH_INL_H
#else
#define MORPHRAY_PACKET_FINISH_INL_H
#endif

#include <hwy/highway.h>

#include <cstring>

#include "cpu/packet.h"
#include "cpu/rule_vectors-inl.h"

HWY_BEFORE_NAMESPACE();
namespace morphray::cpu {
namespace HWY_NAMESPACE {

/// The winners of the rays from `first` on as vectors of x, y and z of each corner, and their ids.
HWY_INLINE void load_winners(const Packet& packet, std::size_t first, VF corners[3][3],
                             VW& prim_ids) {
    const Floats f;
    constexpr std::size_t kLanes = hn::MaxLanes(Floats());
    constexpr std::size_t kCorner = sizeof(Winner) / 3;
    alignas(64) float lanes[3][4 * kLanes];
    for (std::size_t i = 0; i < hn::Lanes(f); ++i) {
        const std::uint32_t index = packet.winner[first + i];
        // Any will do where there is none.
        const Winner& w = packet.winners[index == kNoWinner ? 0 : index];
        std::memcpy(lanes[0] + 4 * i, &w.a, kCorner);
        std::memcpy(lanes[1] + 4 * i, &w.b, kCorner);
        std::memcpy(lanes[2] + 4 * i, &w.c, kCorner);
    }
    VF w[3];
    for (int k = 0; k < 3; ++k) {
        hn::LoadInterleaved4(f, lanes[k], corners[k][0], corners[k][1], corners[k][2], w[k]);
    }
    prim_ids = hn::BitCast(Words(), w[0]);
}

/// The hits of as many consecutive rays as there are lanes, from `first` on.
HWY_INLINE void finish_rays(const Packet& packet, std::size_t first, Hit* HWY_RESTRICT hits) {
    const Floats f;
    const Words words;
    const VW winner = hn::Load(words, packet.winner + first);
    std::uint32_t left = mask_bits(hn::RebindMask(f, hn::Ne(winner, hn::Set(words, kNoWinner))));
    VF t = hn::Zero(f), u = hn::Zero(f), v = hn::Zero(f);
    VW ids = hn::Set(words, kNoPrim);
    if (left != 0) {
        const VF dir[3] = {hn::Load(f, packet.dir_x + first), hn::Load(f, packet.dir_y + first),
                           hn::Load(f, packet.dir_z + first)};
        const VF org[3] = {splat(packet.frame.org.x), splat(packet.frame.org.y),
                           splat(packet.frame.org.z)};
        std::uint32_t by_axis[3];
        lanes_by_axis(dir, left, by_axis);
        const VF slack = splat(0.25f * packet.frame.depth_error);
        VF corners[3][3];
        VW prim_ids;
        load_winners(packet, first, corners, prim_ids);
        for (std::uint32_t axis = 0; axis < 3; ++axis) {
            if (by_axis[axis] == 0) continue;
            VF o[3], d[3], vertex[3][3], own_t, own_u, own_v;
            Mask in_front;
            rotate(axis, org, o);
            rotate(axis, dir, d);
            for (int k = 0; k < 3; ++k) rotate(axis, corners[k], vertex[k]);
            const Mask sufficed = hit_fast(o, d, slack, vertex, own_t, own_u, own_v, in_front);
            const Mask done = hn::And(sufficed, mask_of(by_axis[axis]));
            t = hn::IfThenElse(done, own_t, t);
            u = hn::IfThenElse(done, own_u, u);
            v = hn::IfThenElse(done, own_v, v);
            ids = hn::IfThenElse(hn::RebindMask(words, done), prim_ids, ids);
            left &= ~mask_bits(done);
        }
    }
    hn::StoreInterleaved4(t, u, v, hn::BitCast(f, ids), f, &hits->t);
    for (; left != 0; left &= left - 1) {
        const auto i = static_cast<std::uint32_t>(__builtin_ctz(left));
        const Ray ray = packet.ray(static_cast<std::uint32_t>(first) + i);
        const Winner& best = packet.winners[packet.winner[first + i]];
        TriangleHit exact;
        intersect_triangle(shear_ray(ray.org, ray.dir), ray.tnear, ray.tfar, best.a, best.b, best.c,
                           exact);
        hits[i] = make_hit(exact, best.prim_id);
    }
}

}  // namespace HWY_NAMESPACE
}  // namespace morphray::cpu
HWY_AFTER_NAMESPACE();

#endif
