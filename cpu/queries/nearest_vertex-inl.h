// A lower bound of the distance of a triangle from a point that is much cheaper than the rule.
//
// It takes one direction w. The offset r of each place of the triangle is at least r.w / |w| long,
// and r.w is least at a vertex. With w the offset of the nearest vertex, the bound is the distance
// itself where that vertex is the closest point.
//
// Rounding, that of the rule as well, is covered by the constants (lab/proofs/closest.g). No answer
// depends on the bound, so it may be fused, and differ by target.
#include "common/simd/vectors-inl.h"
#include "cpu/simd/lanes-inl.h"
#include "cpu/simd/rounding_bounds.h"

HWY_BEFORE_NAMESPACE();
namespace mray::cpu {
namespace HWY_NAMESPACE {
using namespace simd::HWY_NAMESPACE;

HWY_INLINE FloatVec fused_dot(const lanes::Float3& a, const lanes::Float3& b) {
    return mul_add(a.x, b.x, mul_add(a.y, b.y, a.z * b.z));
}

/// The square of how far the bound by the nearest vertex is off, by the largest coordinate.
HWY_INLINE FloatVec nearest_vertex_error2(FloatVec size) {
    return mul_add(size * size, splat(kNearestVertexErrorSquare),
                   splat(kLeastNearestVertexErrorSquare));
}

/// Where the rule may give d2 or less for a point and the triangle a, b, c, relative to it.
HWY_INLINE Mask may_be_within(const lanes::Float3& a, const lanes::Float3& b,
                              const lanes::Float3& c, FloatVec error2, FloatVec d2) {
    const FloatVec a2 = fused_dot(a, a);
    const FloatVec b2 = fused_dot(b, b);
    const FloatVec c2 = fused_dot(c, c);
    const FloatVec ab2 = min(a2, b2);
    const FloatVec w2 = min(ab2, c2);
    const lanes::Float3 w = select(c2 < ab2, c, select(b2 < a2, b, a));
    const FloatVec along = max(min3(fused_dot(w, a), fused_dot(w, b), fused_dot(w, c)), zero());
    const FloatVec limit = mul_add(d2, splat(kNearestVertexRounding), error2);
    return along * along <= w2 * limit;
}

}  // namespace HWY_NAMESPACE
}  // namespace mray::cpu
HWY_AFTER_NAMESPACE();
