// The hit rule for those rays of a packet that its bounds leave uncertain: lanes are rays, with one
// triangle for all of them or with one each.

#if defined(MORPHRAY_CPU_PACKET_PACKET_HIT_RULE_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef MORPHRAY_CPU_PACKET_PACKET_HIT_RULE_INL_H
#undef MORPHRAY_CPU_PACKET_PACKET_HIT_RULE_INL_H
#else
#define MORPHRAY_CPU_PACKET_PACKET_HIT_RULE_INL_H
#endif

#include <hwy/highway.h>

#include <cstddef>
#include <cstdint>
#include <cstring>

#include "cpu/packet/packet.h"
#include "cpu/simd/fast_hit_rule-inl.h"
#include "cpu/simd/hit_rule-inl.h"

HWY_BEFORE_NAMESPACE();
namespace morphray::cpu {
namespace HWY_NAMESPACE {

/// Triangles, a lane each.
struct TriangleLanes {
    FloatVec corner[3][3];
    UintVec prim_ids;
};

HWY_INLINE TriangleLanes same_triangle(const Leaf& leaf, std::uint32_t slot) {
    TriangleLanes out;
    for (std::uint32_t k = 0; k < 3; ++k) {
        const LeafVertex& v = leaf.vertex[corner(leaf.vertex[slot].corners, k)];
        out.corner[k][0] = splat(v.x);
        out.corner[k][1] = splat(v.y);
        out.corner[k][2] = splat(v.z);
    }
    out.prim_ids = splat(leaf.prim_id[slot]);
    return out;
}

/// The triangles of some of as many candidates as there are lanes, at least of one; other lanes
/// hold anything.
HWY_INLINE TriangleLanes winning_triangles(const Packet& packet, const std::uint32_t* candidates,
                                           std::uint32_t lanes) {
    const auto leaf_of = [&](std::uint32_t candidate) -> const Leaf& {
        return *packet.hit_leaves[candidate / kLeafTriangles].leaf;
    };
    const std::uint32_t any = candidates[__builtin_ctz(lanes)];
    const auto same = load(candidates) == splat(any);
    if ((lanes & ~bits_of(float_mask(same))) == 0)
        return same_triangle(leaf_of(any), any % kLeafTriangles);
    alignas(64) float corners[3][3][kLanes] = {};
    alignas(64) std::uint32_t prim_ids[kLanes] = {};
    for (; lanes != 0; lanes &= lanes - 1) {
        const auto lane = static_cast<std::uint32_t>(__builtin_ctz(lanes));
        const Leaf& leaf = leaf_of(candidates[lane]);
        const std::uint32_t slot = candidates[lane] % kLeafTriangles;
        for (std::uint32_t k = 0; k < 3; ++k) {
            const LeafVertex& v = leaf.vertex[corner(leaf.vertex[slot].corners, k)];
            corners[k][0][lane] = v.x;
            corners[k][1][lane] = v.y;
            corners[k][2][lane] = v.z;
        }
        prim_ids[lane] = leaf.prim_id[slot];
    }
    TriangleLanes out;
    for (int k = 0; k < 3; ++k) {
        for (int axis = 0; axis < 3; ++axis) out.corner[k][axis] = load(corners[k][axis]);
    }
    out.prim_ids = load(prim_ids);
    return out;
}

/// Keeps a leaf of which a triangle has won, or may win, a ray.
HWY_INLINE void add_hit_leaf(Packet& packet, const Leaf& leaf) {
    packet.hit_leaves.emplace_back();
    HitLeaf& won = packet.hit_leaves.back();
    won.leaf = &leaf;
    std::memcpy(won.prim_id, leaf.prim_id, sizeof won.prim_id);
    const FloatVec away = packet.frame.axis == kMixedAxes
                              ? zero()
                              : splat(packet.frame.depth_rows[0][2]) & splat(-0.0f);
    alignas(64) float values[3][kLeafVertices];
    alignas(64) std::uint32_t corners[kLeafTriangles];
    for (std::size_t l = 0; l < kLeafVertices; l += kLanes) {
        FloatVec v[3], w;
        hn::LoadInterleaved4(kFloats, &leaf.vertex[l].x, v[0], v[1], v[2], w);
        for (int axis = 0; axis < 3; ++axis)
            store((v[axis] - splat(packet.frame.org[axis])) ^ away, values[axis] + l);
        store(as_uint(w), corners + l);
    }
    const std::uint32_t z = packet.frame.axis % kMixedAxes;
    for (std::size_t l = 0; l < kLeafTriangles; l += kLanes) {
        const UintVec packed = load(corners + l);
        for (std::uint32_t axis = 0; axis < 3; ++axis) {
            FloatVec at_corners[3];
            gather_corners(values[(z + 1 + axis) % 3], packed, at_corners);
            for (int k = 0; k < 3; ++k) store(at_corners[k], won.corner[k][axis] + l);
        }
    }
}

/// The rule for rays of a packet.
class PacketRule {
public:
    HWY_INLINE PacketRule(vec3 origin, const FloatVec (&dir)[3]) {
        rays_ = lanes::shear_ray(lanes::Float3(origin), lanes::Float3(dir));
    }

    /// Which of some lanes are hit up to tfar, and where.
    HWY_INLINE Mask intersect(const TriangleLanes& triangles, FloatVec tfar, std::uint32_t lanes,
                              lanes::TriangleHit& hits) const {
        return intersect_triangles(
            rays_, mask_of(lanes), zero(), tfar, lanes::Float3(triangles.corner[0]),
            lanes::Float3(triangles.corner[1]), lanes::Float3(triangles.corner[2]), hits);
    }

private:
    lanes::ShearedRay rays_;
};

}  // namespace HWY_NAMESPACE
}  // namespace morphray::cpu
HWY_AFTER_NAMESPACE();

#endif
