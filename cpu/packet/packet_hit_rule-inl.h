// The hit rule for those rays of a packet that its bounds leave uncertain: lanes are rays, with one
// triangle for all of them or one triangle each.

#if defined(MORPHRAY_CPU_PACKET_PACKET_HIT_RULE_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef MORPHRAY_CPU_PACKET_PACKET_HIT_RULE_INL_H
#undef MORPHRAY_CPU_PACKET_PACKET_HIT_RULE_INL_H
#else
#define MORPHRAY_CPU_PACKET_PACKET_HIT_RULE_INL_H
#endif

#include <hwy/highway.h>

#include <cstdint>

#include "common/interop/bvh_layout.h"
#include "cpu/simd/fast_hit_rule-inl.h"
#include "cpu/simd/hit_rule-inl.h"

HWY_BEFORE_NAMESPACE();
namespace mray::cpu {
namespace HWY_NAMESPACE {

/// Triangles for PacketRule, a lane each.
struct PacketRuleTriangles {
    FloatVec corner[3][3];
    UintVec prim_ids;
};

/// One triangle of a leaf in all lanes.
HWY_INLINE PacketRuleTriangles same_triangle(const Leaf& leaf, std::uint32_t slot) {
    PacketRuleTriangles out;
    for (std::uint32_t k = 0; k < 3; ++k) {
        const LeafVertex& v = leaf.vertex[corner(leaf.vertex[slot].corners, k)];
        out.corner[k][0] = splat(v.x);
        out.corner[k][1] = splat(v.y);
        out.corner[k][2] = splat(v.z);
    }
    out.prim_ids = splat(leaf.prim_id[slot]);
    return out;
}

/// The rule for rays of a packet, from tnear = 0 on.
class PacketRule {
public:
    HWY_INLINE PacketRule(vec3 origin, const FloatVec (&dir)[3]) {
        rays_ = lanes::shear_ray(lanes::Float3(origin), lanes::Float3(dir));
    }

    /// Returns which of the lanes are hit up to tfar, and sets where.
    HWY_INLINE Mask intersect(const PacketRuleTriangles& triangles, FloatVec tfar,
                              std::uint32_t lanes, lanes::TriangleHit& hits) const {
        return intersect_triangles(
            rays_, mask_of(lanes), zero(), tfar, lanes::Float3(triangles.corner[0]),
            lanes::Float3(triangles.corner[1]), lanes::Float3(triangles.corner[2]), hits);
    }

private:
    lanes::ShearedRay rays_;
};

}  // namespace HWY_NAMESPACE
}  // namespace mray::cpu
HWY_AFTER_NAMESPACE();

#endif
