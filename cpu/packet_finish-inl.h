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

/// Sixteen (or fewer) consecutive rays from `first` on: their hits.
HWY_INLINE void finish_rays(const Packet& packet, std::size_t first, Hit* hits) {
    const Floats f;
    constexpr std::size_t kLanes = hn::MaxLanes(Floats());
    const VW winner = hn::Load(Words(), packet.winner + first);
    const Mask hit = hn::RebindMask(f, hn::Ne(winner, hn::Set(Words(), kNoWinner)));
    std::uint32_t left = mask_bits(hit);
    for (std::size_t i = 0; i < hn::Lanes(f); ++i) hits[i] = no_hit();
    if (left == 0) return;
    alignas(64) float vertices[3][4 * kLanes];
    const Winner none{};
    constexpr std::size_t kCorner = sizeof(Winner) / 3;
    for (std::size_t i = 0; i < hn::Lanes(f); ++i) {
        const std::uint32_t index = packet.winner[first + i];
        const Winner& w = index == kNoWinner ? none : packet.winners[index];
        std::memcpy(vertices[0] + 4 * i, &w.a, kCorner);
        std::memcpy(vertices[1] + 4 * i, &w.b, kCorner);
        std::memcpy(vertices[2] + 4 * i, &w.c, kCorner);
    }
    const VF dir[3] = {hn::Load(f, packet.dir_x + first), hn::Load(f, packet.dir_y + first),
                       hn::Load(f, packet.dir_z + first)};
    const VF org[3] = {splat(packet.frame.org.x), splat(packet.frame.org.y),
                       splat(packet.frame.org.z)};
    std::uint32_t by_axis[3];
    lanes_by_axis(dir, left, by_axis);
    const VF slack = splat(0.25f * packet.frame.depth_error);
    VF in[3][3];
    VF w;
    VF prims = hn::Zero(f);
    for (int k = 0; k < 3; ++k) {
        hn::LoadInterleaved4(f, vertices[k], in[k][0], in[k][1], in[k][2], w);
        if (k == 0) prims = w;
    }
    alignas(64) float ts[kLanes], us[kLanes], vs[kLanes];
    alignas(64) std::uint32_t ids[kLanes];
    hn::Store(hn::BitCast(Words(), prims), Words(), ids);
    for (std::uint32_t axis = 0; axis < 3; ++axis) {
        if (by_axis[axis] == 0) continue;
        VF o[3], d[3], vertex[3][3], t, u, v;
        Mask in_front;
        rotate(axis, org, o);
        rotate(axis, dir, d);
        for (int k = 0; k < 3; ++k) rotate(axis, in[k], vertex[k]);
        const std::uint32_t done =
            mask_bits(hit_fast(o, d, slack, vertex, t, u, v, in_front)) & by_axis[axis];
        hn::Store(t, f, ts);
        hn::Store(u, f, us);
        hn::Store(v, f, vs);
        for (std::uint32_t bits = done; bits != 0; bits &= bits - 1) {
            const int i = __builtin_ctz(bits);
            hits[i] = {ts[i], us[i], vs[i], ids[i]};
        }
        left &= ~done;
    }
    for (; left != 0; left &= left - 1) {
        const int i = __builtin_ctz(left);
        const Ray ray =
            packet.ray(static_cast<std::uint32_t>(first) + static_cast<std::uint32_t>(i));
        const Winner& best = packet.winners[packet.winner[first + static_cast<std::size_t>(i)]];
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
