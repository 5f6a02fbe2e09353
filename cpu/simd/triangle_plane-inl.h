// refine_hit (common/interop/hit_rule.h) in doubles, for rays that go through a triangle. Where the
// errors of both leave no bit open the results are the same; elsewhere the rule is asked. Checked:
// lab/proofs/place.g.
#if defined(MORPHRAY_CPU_SIMD_TRIANGLE_PLANE_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef MORPHRAY_CPU_SIMD_TRIANGLE_PLANE_INL_H
#undef MORPHRAY_CPU_SIMD_TRIANGLE_PLANE_INL_H
#else
#define MORPHRAY_CPU_SIMD_TRIANGLE_PLANE_INL_H
#endif

#include "cpu/simd/lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace mray::cpu::HWY_NAMESPACE {

// Doubles for the lanes of a vector of floats take kDoubleParts vectors.
inline constexpr std::uint32_t kDoubleParts = kLanes == 1 ? 1 : 2;
using DoubleTag = hn::CappedTag<double, kMaxLanes / kDoubleParts>;
using DoubleVec = hn::Vec<DoubleTag>;
inline constexpr DoubleTag kDoubles;
inline constexpr hn::Rebind<float, DoubleTag> kHalves;

HWY_INLINE DoubleVec doubles_of(FloatVec v, [[maybe_unused]] std::uint32_t part) {
#if HWY_TARGET == HWY_SCALAR
    return hn::PromoteTo(kDoubles, v);
#else
    return hn::PromoteTo(kDoubles,
                         part == 0 ? hn::LowerHalf(kHalves, v) : hn::UpperHalf(kHalves, v));
#endif
}

HWY_INLINE FloatVec floats_of(const DoubleVec parts[kDoubleParts]) {
#if HWY_TARGET == HWY_SCALAR
    return hn::DemoteTo(kHalves, parts[0]);
#else
    return hn::Combine(kFloats, hn::DemoteTo(kHalves, parts[1]), hn::DemoteTo(kHalves, parts[0]));
#endif
}

struct Double3 {
    DoubleVec x, y, z;

    Double3() = default;
    HWY_INLINE Double3(DoubleVec x_, DoubleVec y_, DoubleVec z_) : x(x_), y(y_), z(z_) {}
    HWY_INLINE Double3(const lanes::Float3& v, std::uint32_t part)
        : x(doubles_of(v.x, part)), y(doubles_of(v.y, part)), z(doubles_of(v.z, part)) {}

    friend HWY_INLINE Double3 operator-(const Double3& a, const Double3& b) {
        return {a.x - b.x, a.y - b.y, a.z - b.z};
    }
    friend HWY_INLINE Double3 operator+(const Double3& a, const Double3& b) {
        return {a.x + b.x, a.y + b.y, a.z + b.z};
    }
};

HWY_INLINE Double3 magnitudes(const Double3& v) {
    return {hn::Abs(v.x), hn::Abs(v.y), hn::Abs(v.z)};
}
HWY_INLINE DoubleVec greatest(const Double3& v) { return hn::Max(v.x, hn::Max(v.y, v.z)); }
HWY_INLINE DoubleVec dot(const Double3& a, const Double3& b) {
    return a.x * b.x + a.y * b.y + a.z * b.z;
}
/// The products whose differences are a x b.
HWY_INLINE Double3 left_products(const Double3& a, const Double3& b) {
    return {a.y * b.z, a.z * b.x, a.x * b.y};
}
HWY_INLINE Double3 cross(const Double3& a, const Double3& b) {
    return left_products(a, b) - Double3(b.y * a.z, b.z * a.x, b.x * a.y);
}

/// A triangle a lane as rays from one origin see it: with n, u and v for these vectors and d a
/// direction,
///     t = height / n.d,   weights u.d / n.d and v.d / n.d.
/// With R = |1 / n.d|, t is off by T = kPairError (of_height R + t + of_slant t R), and the weights
/// by weight_part + weight_by_slant R + weight_by_t T: both here and in pairs.
struct TrianglePlane {
    Double3 n, u, v;
    DoubleVec height, of_height, of_slant;
    DoubleVec weight_part, weight_by_slant, weight_by_t;
};

// The part of sums of products by which the rule's pairs, and doubles, are off.
inline constexpr double kPairError = 0x1.1p-42;

HWY_INLINE DoubleVec real(double x) { return hn::Set(kDoubles, x); }

HWY_INLINE TrianglePlane triangle_plane(const Double3& org, const Double3& a, const Double3& b,
                                        const Double3& c) {
    const Double3 e1 = b - a, e2 = c - a, s = a - org;
    const Double3 n = cross(e1, e2);
    const Double3 products = magnitudes(left_products(e1, e2)) + magnitudes(left_products(e2, e1));
    const DoubleVec longest = greatest(magnitudes(e1) + magnitudes(e2));
    const DoubleVec reach = greatest(magnitudes(s)), widest = greatest(magnitudes(n));
    // No ray meets a triangle of width 0.
    const DoubleVec by_widest =
        real(1) / hn::IfThenElse(widest > hn::Zero(kDoubles), widest, real(1));
    const DoubleVec across = real(2) * longest * by_widest;
    const DoubleVec of_slant = real(2) * (products.x + products.y + products.z);
    return {n,
            cross(e2, s),
            cross(s, e1),
            dot(n, s),
            dot(products, magnitudes(s)),
            of_slant,
            across * (real(0x1p-44) * (reach + real(4) * longest) + real(0x1p-60)) +
                real(kPairError) * (greatest(products) * by_widest + real(1)),
            real(0x1p-46) * (longest * reach + of_slant),
            real(2.5) * across};
}

/// Sets t, u and v as refine_hit does for rough hits in these lanes (bits) whose edge functions are
/// not 0; false where it has to. planes: those of each part of the lanes.
template <class Planes>
HWY_INLINE Mask place_hits(Planes planes, const lanes::Float3& dir, std::uint32_t lanes,
                           lanes::TriangleHit& hit) {
    constexpr std::uint32_t kPartLanes = kLanes / kDoubleParts;
    const DoubleVec none = hn::Zero(kDoubles), one = real(1);
    DoubleVec least[3][kDoubleParts], most[3][kDoubleParts];
    for (std::uint32_t part = 0; part < kDoubleParts; ++part) {
        if ((lanes >> part * kPartLanes & ((1u << kPartLanes) - 1)) == 0) {
            for (int k = 0; k < 3; ++k) least[k][part] = most[k][part] = none;
            most[0][part] = real(-1);
            continue;
        }
        const TrianglePlane& p = planes(part);
        const Double3 d(dir, part);
        const DoubleVec along = dot(p.n, d);
        const auto is_met = hn::Abs(along) > none;
        const DoubleVec inverse = one / hn::IfThenElse(is_met, along, one);
        const DoubleVec slant = hn::Abs(inverse), t = p.height * inverse;
        const DoubleVec u = dot(p.u, d) * inverse, v = dot(p.v, d) * inverse;
        const DoubleVec t_error =
            real(kPairError) * (p.of_height * slant + t * (one + p.of_slant * slant));
        const DoubleVec error = p.weight_part + p.weight_by_slant * slant + p.weight_by_t * t_error;
        const auto is_inside = hn::And(hn::Min(u, v) > error, u + v < one - real(3) * error);
        const auto is_ahead = hn::And(t > real(kTiny), t < real(kFarthestHit));
        const auto is_known =
            hn::And(hn::And(is_met, t_error < real(0x1p-25) * t), hn::And(is_inside, is_ahead));
        least[0][part] = hn::IfThenElse(is_known, t - t_error, none);
        most[0][part] = hn::IfThenElse(is_known, t + t_error, real(-1));
        // Weights that floats do not hold would overflow.
        const auto weight = [&](DoubleVec w)
                                HWY_ATTR { return hn::Min(hn::Max(w, none), real(2)); };
        least[1][part] = weight(u - error);
        most[1][part] = weight(u + error);
        least[2][part] = weight(v - error);
        most[2][part] = weight(v + error);
    }
    hit.t = floats_of(least[0]);
    hit.u = lanes::grid_weight(floats_of(least[1]));
    hit.v = lanes::grid_weight(floats_of(least[2]));
    const Mask is_one = (hit.t == floats_of(most[0])) &
                        (hit.u == lanes::grid_weight(floats_of(most[1]))) &
                        (hit.v == lanes::grid_weight(floats_of(most[2])));
    // Both may have been rounded up.
    hit.v = min(hit.v, 1.0f - hit.u);
    return is_one;
}

}  // namespace mray::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per target
