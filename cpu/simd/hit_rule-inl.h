// intersect_triangle (common/interop/hit_rule.h) on vectors: the control flow alone. All arithmetic
// is the shared text (cpu/simd/lanes-inl.h).
#if defined(MORPHRAY_CPU_SIMD_HIT_RULE_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef MORPHRAY_CPU_SIMD_HIT_RULE_INL_H
#undef MORPHRAY_CPU_SIMD_HIT_RULE_INL_H
#else
#define MORPHRAY_CPU_SIMD_HIT_RULE_INL_H
#endif

#include <hwy/highway.h>

#include "common/scene_queries.h"
#include "cpu/simd/lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace mray::cpu {
namespace HWY_NAMESPACE {

/// The exact path of intersect_triangle, or of cross_triangle, for vertices with rotated axes.
template <Crossing kCrossing = Crossing::kEach>
HWY_INLINE Mask intersect_exactly(const lanes::ShearedRay& s, FloatVec tnear, FloatVec tfar,
                                  const lanes::Float3& a, const lanes::Float3& b,
                                  const lanes::Float3& c, lanes::TriangleHit& hit) {
    const lanes::Float3 pa = lanes::project_rotated(s, a);
    const lanes::Float3 pb = lanes::project_rotated(s, b);
    const lanes::Float3 pc = lanes::project_rotated(s, c);
    const lanes::Edges e = lanes::exact_edges(pa, pb, pc);
    Mask hits = lanes::exact_hit(s, e, pa.z, pb.z, pc.z, hit);
    if constexpr (kCrossing == Crossing::kOwner) hits = hits & lanes::owns_ray(e, pa, pb, pc);
    return hits & lanes::is_in_range(hit.t, tnear, tfar) & lanes::finite_vertices(a, b, c);
}

/// Those of the active lanes in which the ray hits the triangle; t, u and v of other lanes are
/// undefined. The exact path is taken if it is uncertain for an active lane.
HWY_INLINE Mask intersect_triangles(const lanes::ShearedRay& s, Mask active, FloatVec tnear,
                                    FloatVec tfar, const lanes::Float3& a, const lanes::Float3& b,
                                    const lanes::Float3& c, lanes::TriangleHit& hit) {
    const lanes::Float3 ra = lanes::rotate_axes(a, s.axis);
    const lanes::Float3 rb = lanes::rotate_axes(b, s.axis);
    const lanes::Float3 rc = lanes::rotate_axes(c, s.axis);
    const lanes::Float3 pa = lanes::project_rotated_fast(s, ra);
    const lanes::Float3 pb = lanes::project_rotated_fast(s, rb);
    const lanes::Float3 pc = lanes::project_rotated_fast(s, rc);
    const lanes::Edges e = lanes::fast_edges(pa, pb, pc);
    const Mask is_certain = lanes::weighted_hit(s, e, pa.z, pb.z, pc.z, hit);
    const Mask is_hit = lanes::surely_inside(s, e) & is_certain;
    Mask hits =
        lanes::is_in_range(hit.t, tnear, tfar) & (is_hit & lanes::finite_vertices(ra, rb, rc));
    const Mask uncertain = active & and_not(is_hit, lanes::may_be_inside(e));
    if (!none(uncertain)) {
        lanes::TriangleHit exact;
        const Mask exact_hits = intersect_exactly(s, tnear, tfar, ra, rb, rc, exact);
        hits = hits | (uncertain & exact_hits);
        hit.t = select(uncertain, exact.t, hit.t);
        hit.u = select(uncertain, exact.u, hit.u);
        hit.v = select(uncertain, exact.v, hit.v);
    }
    return hits & active;
}

}  // namespace HWY_NAMESPACE
}  // namespace mray::cpu
HWY_AFTER_NAMESPACE();

#endif  // per target
