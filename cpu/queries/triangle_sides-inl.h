// Lower bounds of the distances between points and triangles that are much cheaper than the rule,
// relative to a centre near the points.
//
// distance2() takes two directions w1 and w2, and how far the whole triangle is from the point
// along each of them: s1 and s2. Let q be the offset to the closest point of the triangle, and let
// v be s1 w1 + s2 w2. Then q.w1 >= s1 and q.w2 >= s2, so q.v >= s1^2 + s2^2. Cauchy's inequality
// |q.v| <= |q| |v| and |v|^2 <= (s1^2 + s2^2) (W + |w1.w2|), with W the larger of |w1|^2 and
// |w2|^2, give
//
//     |q|^2 >= (s1^2 + s2^2) / (W + |w1.w2|).
//
// This holds for any two directions. Those in use are the normal of the plane and that of an edge;
// where they are inaccurate, as for needles, the bound is only smaller.
//
// may_be_within() takes one direction w. The offset r of each place of the triangle is at least
// r.w / |w| long, and r.w is least at a vertex. With w the offset of the nearest vertex, the bound
// is the distance itself where that vertex is the closest point.
//
// Rounding, that of the rule as well, is covered by the constants (lab/proofs/closest.g). No answer
// depends on the bounds, so they may be fused, and differ by target.
#include <cstddef>
#include <cstdint>

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

HWY_INLINE lanes::Float3 fused_cross(const lanes::Float3& a, const lanes::Float3& b) {
    return {mul_sub(a.y, b.z, a.z * b.y), mul_sub(a.z, b.x, a.x * b.z),
            mul_sub(a.x, b.y, a.y * b.x)};
}

/// A direction and its squared length: about 1, or 0 for vectors that are too short or too long.
struct Direction {
    lanes::Float3 dir;
    FloatVec length2;

    HWY_INLINE explicit Direction(const lanes::Float3& v) {
        const FloatVec scale = hn::ApproximateReciprocalSqrt(fused_dot(v, v));
        const lanes::Float3 scaled(v.x * scale, v.y * scale, v.z * scale);
        const FloatVec scaled2 = fused_dot(scaled, scaled);
        const Mask is_usable = (scaled2 > splat(0.5f)) & (scaled2 < splat(kLongestDirection2));
        dir = {zero_unless(is_usable, scaled.x), zero_unless(is_usable, scaled.y),
               zero_unless(is_usable, scaled.z)};
        length2 = zero_unless(is_usable, scaled2);
    }
};

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

class TriangleSides {
public:
    /// `extent` is the largest coordinate of the points.
    HWY_INLINE TriangleSides(const lanes::Float3& a, const lanes::Float3& b, const lanes::Float3& c,
                             FloatVec extent) {
        const FloatVec size = max3(lanes::largest_component(a), lanes::largest_component(b),
                                   lanes::largest_component(c)) +
                              extent;
        store(nearest_vertex_error2(size), vertex_error2_);
        store_lanes(a, vertex_[0]);
        store_lanes(b, vertex_[1]);
        store_lanes(c, vertex_[2]);
        const lanes::Float3 ab = b - a;
        const lanes::Float3 bc = c - b;
        const Direction normal(fused_cross(ab, bc));
        const Direction dirs[kDirs] = {normal, Direction(fused_cross(ab, normal.dir)),
                                       Direction(fused_cross(bc, normal.dir)),
                                       Direction(fused_cross(a - c, normal.dir))};
        const FloatVec error = mul_add(size, splat(kSideError), splat(kLeastSideError));
        FloatVec length2 = zero();
        FloatVec slant = zero();
        for (int i = 0; i < kDirs; ++i) {
            const lanes::Float3& dir = dirs[i].dir;
            const FloatVec along[3] = {fused_dot(dir, a), fused_dot(dir, b), fused_dot(dir, c)};
            store_lanes(dir, dir_[i]);
            store(max3(along[0], along[1], along[2]) + error, upper_[i]);
            length2 = max(length2, dirs[i].length2);
            if (i == 0) {
                store(min3(along[0], along[1], along[2]) - error, lower_);
            } else {
                slant = max(slant, abs(fused_dot(dir, normal.dir)));
            }
        }
        store(splat(1.0f) / mul_add(length2 + slant, splat(kSideRounding), splat(kSideSlant)),
              scale_);
    }

    /// Not above what the rule gives for triangle i and points relative to the centre.
    HWY_INLINE FloatVec distance2(std::size_t i, const lanes::Float3& p) const {
        const FloatVec height = fused_dot(at(i, dir_[0]), p);
        const FloatVec beside =
            max3(height - splat(upper_[0][i]), splat(lower_[i]) - height, zero());
        FloatVec out = zero();
        for (int edge = 1; edge < kDirs; ++edge)
            out = max(out, fused_dot(at(i, dir_[edge]), p) - splat(upper_[edge][i]));
        return mul_add(beside, beside, out * out) * splat(scale_[i]);
    }

    /// The points for which the rule may give d2 or less for triangle i.
    HWY_INLINE Mask may_be_within(std::size_t i, const lanes::Float3& p, FloatVec d2) const {
        return HWY_NAMESPACE::may_be_within(at(i, vertex_[0]) - p, at(i, vertex_[1]) - p,
                                            at(i, vertex_[2]) - p, splat(vertex_error2_[i]), d2);
    }

private:
    /// The normal, and the directions out of the three edges.
    static constexpr int kDirs = 4;
    using Vectors = float[3][kLanes];

    HWY_INLINE static void store_lanes(const lanes::Float3& v, Vectors& to) {
        store(v.x, to[0]);
        store(v.y, to[1]);
        store(v.z, to[2]);
    }
    HWY_INLINE static lanes::Float3 at(std::size_t i, const Vectors& v) {
        return {splat(v[0][i]), splat(v[1][i]), splat(v[2][i])};
    }

    HWY_ALIGN Vectors vertex_[3];
    HWY_ALIGN Vectors dir_[kDirs];
    HWY_ALIGN float upper_[kDirs][kLanes];
    HWY_ALIGN float lower_[kLanes];
    HWY_ALIGN float scale_[kLanes];
    HWY_ALIGN float vertex_error2_[kLanes];
};

}  // namespace HWY_NAMESPACE
}  // namespace mray::cpu
HWY_AFTER_NAMESPACE();
