// The shared text of cameras, surfaces, secondary rays and colours on vectors, operation by
// operation: a lane gets the bits of common/interop/{camera,surface,shade}.h.

#if defined(MORPHRAY_CPU_IMAGE_PIXEL_VECTORS_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef MORPHRAY_CPU_IMAGE_PIXEL_VECTORS_INL_H
#undef MORPHRAY_CPU_IMAGE_PIXEL_VECTORS_INL_H
#else
#define MORPHRAY_CPU_IMAGE_PIXEL_VECTORS_INL_H
#endif

#include <hwy/highway.h>

#include "common/interop/camera.h"
#include "common/interop/shading.h"
#include "cpu/simd/rule_vectors-inl.h"

HWY_BEFORE_NAMESPACE();
namespace morphray::cpu {
namespace HWY_NAMESPACE {

struct V3 {
    VF x, y, z;
};

struct SurfaceLanes {
    V3 point, normal;
    VF size;
};

/// Of rays that differ in these alone.
struct DirectionLanes {
    V3 dir;
    VF tfar;
};

HWY_INLINE VW splat_word(std::uint32_t x) { return hn::Set(Words(), x); }
HWY_INLINE VW bits_of(VF x) { return hn::BitCast(Words(), x); }
HWY_INLINE VF float_of(VW x) { return hn::BitCast(Floats(), x); }

HWY_INLINE V3 splat3(vec3 v) { return {splat(v.x), splat(v.y), splat(v.z)}; }
HWY_INLINE V3 plus(const V3& a, const V3& b) {
    return {hn::Add(a.x, b.x), hn::Add(a.y, b.y), hn::Add(a.z, b.z)};
}
HWY_INLINE V3 minus(const V3& a, const V3& b) {
    return {hn::Sub(a.x, b.x), hn::Sub(a.y, b.y), hn::Sub(a.z, b.z)};
}
HWY_INLINE V3 times(const V3& a, VF s) {
    return {hn::Mul(a.x, s), hn::Mul(a.y, s), hn::Mul(a.z, s)};
}
HWY_INLINE V3 select(Mask m, const V3& a, const V3& b) {
    return {hn::IfThenElse(m, a.x, b.x), hn::IfThenElse(m, a.y, b.y), hn::IfThenElse(m, a.z, b.z)};
}

HWY_INLINE VF dot_of(const V3& a, const V3& b) {
    return hn::Add(hn::Add(hn::Mul(a.x, b.x), hn::Mul(a.y, b.y)), hn::Mul(a.z, b.z));
}
HWY_INLINE V3 cross_of(const V3& a, const V3& b) {
    return {hn::Sub(hn::Mul(a.y, b.z), hn::Mul(a.z, b.y)),
            hn::Sub(hn::Mul(a.z, b.x), hn::Mul(a.x, b.z)),
            hn::Sub(hn::Mul(a.x, b.y), hn::Mul(a.y, b.x))};
}

HWY_INLINE VF rsqrt_of(VF x) {
    const VF h = hn::Mul(splat(0.5f), x);
    VF y = float_of(hn::Sub(splat_word(0x5F375A86u), hn::ShiftRight<1>(bits_of(x))));
    y = hn::Mul(y, hn::Sub(splat(1.5f), hn::Mul(hn::Mul(h, y), y)));
    y = hn::Mul(y, hn::Sub(splat(1.5f), hn::Mul(hn::Mul(h, y), y)));
    return hn::Add(y, hn::Mul(y, hn::Sub(splat(0.5f), hn::Mul(hn::Mul(h, y), y))));
}

HWY_INLINE VF snap(VF x, float on_grid, float by) {
    const VF snapped = hn::Sub(hn::Add(x, splat(by)), splat(by));
    return hn::IfThenElse(hn::Ge(hn::Abs(x), splat(on_grid)), x, snapped);
}
HWY_INLINE V3 snap3(const V3& v, float on_grid, float by) {
    return {snap(v.x, on_grid, by), snap(v.y, on_grid, by), snap(v.z, on_grid, by)};
}

HWY_INLINE VF exponent_of(VF x) { return float_of(hn::And(bits_of(x), splat_word(0x7F800000u))); }
HWY_INLINE VF largest_of(const V3& v) {
    return hn::Max(hn::Max(hn::Abs(v.x), hn::Abs(v.y)), hn::Abs(v.z));
}
HWY_INLINE VF sum_of_magnitudes(const V3& v) {
    return hn::Add(hn::Add(hn::Abs(v.x), hn::Abs(v.y)), hn::Abs(v.z));
}

HWY_INLINE V3 canonical_of(const V3& d) {
    const VF largest = largest_of(d);
    const VF to_unit = float_of(hn::Sub(splat_word(0x7F000000u), bits_of(exponent_of(largest))));
    const VF s = hn::IfThenElse(hn::Gt(largest, splat(0.0f)), to_unit, splat(1.0f));
    return snap3(times(d, s), kDirectionOnGrid, kDirectionSnap);
}

HWY_INLINE V3 unit_of(const V3& v) {
    const VF largest = largest_of(v);
    const VF s = hn::IfThenElseZero(hn::Gt(largest, splat(0.0f)), rcp_of_positive(largest));
    const V3 w = times(v, s);
    return times(w, rsqrt_of(dot_of(w, w)));
}

/// camera_ray().dir of the pixels whose middles these are.
HWY_INLINE V3 camera_directions(const Camera& camera, VF px, VF py) {
    const auto along = [&](int axis) HWY_ATTR {
        return hn::Add(hn::Add(splat(camera.corner[axis]), hn::Mul(splat(camera.du[axis]), px)),
                       hn::Mul(splat(camera.dv[axis]), py));
    };
    return canonical_of({along(0), along(1), along(2)});
}

HWY_INLINE SurfaceLanes surfaces_at(vec3 org, const V3& dir, VF t, const V3 corners[3]) {
    const V3 travel{hn::Mul(t, dir.x), hn::Mul(t, dir.y), hn::Mul(t, dir.z)};
    SurfaceLanes s;
    s.point = plus(splat3(org), travel);
    const V3 across = cross_of(minus(corners[1], corners[0]), minus(corners[2], corners[0]));
    const Mask some = hn::Gt(largest_of(across), splat(0.0f));
    const V3 n = unit_of(select(some, across, dir));
    const Mask away = hn::Gt(dot_of(n, dir), splat(0.0f));
    s.normal = select(away, {hn::Neg(n.x), hn::Neg(n.y), hn::Neg(n.z)}, n);
    s.size = hn::Add(sum_of_magnitudes(s.point), sum_of_magnitudes(travel));
    return s;
}

HWY_INLINE V3 off_surfaces(const SurfaceLanes& s, VF size) {
    const VF offset = hn::Mul(splat(kSurfaceOffset), size);
    return snap3(plus(s.point, times(s.normal, offset)), kCoordinateOnGrid, kCoordinateSnap);
}

HWY_INLINE DirectionLanes shadow_rays(const SurfaceLanes& s, const V3& to_light, vec3 light) {
    const VF size = hn::Add(s.size, sum_of_magnitudes(to_light));
    const V3 dir = minus(off_surfaces(s, size), splat3(light));
    return {canonical_of(dir), exponent_of(largest_of(dir))};
}

HWY_INLINE VW mixed_bits(VW x) {
    const VW state = hn::Add(hn::Mul(x, splat_word(747796405u)), splat_word(2891336453u));
    const VW shift = hn::Add(hn::ShiftRight<28>(state), splat_word(4u));
    const VW word = hn::Mul(hn::Xor(hn::Shr(state, shift), state), splat_word(277803737u));
    return hn::Xor(hn::ShiftRight<22>(word), word);
}

HWY_INLINE VF signed_units(VW x) {
    const VF f = float_of(hn::Or(hn::ShiftRight<9>(x), splat_word(0x3F800000u)));
    return hn::Sub(hn::Mul(splat(2.0f), f), splat(3.0f));
}

/// ao_ray() of the surfaces that pixels (x, y) show, but for the origin.
HWY_INLINE DirectionLanes ao_rays(const SurfaceLanes& s, VW x, VW y, std::uint32_t sample,
                                  float tfar) {
    VW seed = mixed_bits(hn::Add(x, mixed_bits(hn::Add(y, splat_word(mix_bits(sample))))));
    V3 drawn = s.normal;
    VF drawn_length2 = splat(0.0f);
    Mask more = hn::Eq(drawn_length2, drawn_length2);
    for (int attempt = 0; attempt < 8 && !hn::AllFalse(Floats(), more); ++attempt) {
        V3 point;
        seed = mixed_bits(seed);
        point.x = signed_units(seed);
        seed = mixed_bits(seed);
        point.y = signed_units(seed);
        seed = mixed_bits(seed);
        point.z = signed_units(seed);
        const VF length2 = dot_of(point, point);
        drawn = select(more, point, drawn);
        const Mask in_ball =
            hn::And(hn::Le(length2, splat(1.0f)), hn::Gt(length2, splat(0.0009765625f)));
        drawn_length2 = hn::IfThenElse(hn::And(more, in_ball), length2, drawn_length2);
        more = hn::Eq(drawn_length2, splat(0.0f));
    }
    const Mask is_drawn = hn::Gt(drawn_length2, splat(0.0f));
    const VF l = hn::Mul(splat(0.9990234375f),
                         rsqrt_of(hn::IfThenElse(is_drawn, drawn_length2, splat(1.0f))));
    const V3 dir = select(is_drawn, unit_of(plus(s.normal, times(drawn, l))), s.normal);
    return {canonical_of(dir), hn::Mul(splat(tfar), exponent_of(largest_of(dir)))};
}

/// The intensity of what light reaches, given the cosine between its normal and the light.
HWY_INLINE VF lit_intensity(VF facing) {
    return hn::Add(splat(0.125f), hn::Mul(splat(0.875f), facing));
}

HWY_INLINE VW encoded_channel(VF x) {
    const VF c = hn::Min(hn::Max(x, splat(0.0f)), splat(1.0f));
    const VF root =
        hn::IfThenElseZero(hn::Gt(c, splat(0.00000095367431640625f)), hn::Mul(c, rsqrt_of(c)));
    const VF scaled = hn::Add(hn::Mul(root, splat(255.0f)), splat(0.5f));
    return hn::BitCast(Words(), hn::ConvertTo(hn::RebindToSigned<Floats>(), scaled));
}

HWY_INLINE VW colours_of(VF intensity, VW albedo) {
    const VF k = hn::Mul(intensity, splat(0.0039215688593685626983642578125f));
    const auto channel = [&](VW bits) HWY_ATTR {
        const auto ints =
            hn::BitCast(hn::RebindToSigned<Floats>(), hn::And(bits, splat_word(0xFFu)));
        return encoded_channel(hn::Mul(hn::ConvertTo(Floats(), ints), k));
    };
    const VW r = channel(albedo);
    const VW g = channel(hn::ShiftRight<8>(albedo));
    const VW b = channel(hn::ShiftRight<16>(albedo));
    return hn::Or(hn::Or(r, hn::ShiftLeft<8>(g)),
                  hn::Or(hn::ShiftLeft<16>(b), splat_word(0xFF000000u)));
}

}  // namespace HWY_NAMESPACE
}  // namespace morphray::cpu
HWY_AFTER_NAMESPACE();

#endif
