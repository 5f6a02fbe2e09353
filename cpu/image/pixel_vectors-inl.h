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
#include "cpu/simd/fast_hit_rule-inl.h"

HWY_BEFORE_NAMESPACE();
namespace morphray::cpu {
namespace HWY_NAMESPACE {
using namespace simd::HWY_NAMESPACE;
using simd::HWY_NAMESPACE::select;

struct V3 {
    FloatVec x, y, z;
};

struct SurfaceLanes {
    V3 point, normal;
    FloatVec size;
};

/// Of rays that differ in these alone.
struct DirectionLanes {
    V3 dir;
    FloatVec tfar;
};

HWY_INLINE V3 splat3(vec3 v) { return {splat(v.x), splat(v.y), splat(v.z)}; }
HWY_INLINE V3 plus(const V3& a, const V3& b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
HWY_INLINE V3 minus(const V3& a, const V3& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
HWY_INLINE V3 times(const V3& a, FloatVec s) { return {a.x * s, a.y * s, a.z * s}; }
HWY_INLINE V3 select(Mask m, const V3& a, const V3& b) {
    return {select(m, a.x, b.x), select(m, a.y, b.y), select(m, a.z, b.z)};
}

HWY_INLINE FloatVec dot_of(const V3& a, const V3& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
HWY_INLINE V3 cross_of(const V3& a, const V3& b) {
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

HWY_INLINE FloatVec rsqrt_of(FloatVec x) {
    const FloatVec h = splat(0.5f) * x;
    FloatVec y = as_float(splat(0x5F375A86u) - shift_right<1>(as_uint(x)));
    y = y * (splat(1.5f) - h * y * y);
    y = y * (splat(1.5f) - h * y * y);
    return y + y * (splat(0.5f) - h * y * y);
}

HWY_INLINE FloatVec snap(FloatVec x, float on_grid, float by) {
    const FloatVec snapped = x + splat(by) - splat(by);
    return select(abs(x) >= splat(on_grid), x, snapped);
}
HWY_INLINE V3 snap3(const V3& v, float on_grid, float by) {
    return {snap(v.x, on_grid, by), snap(v.y, on_grid, by), snap(v.z, on_grid, by)};
}

HWY_INLINE FloatVec exponent_of(FloatVec x) { return as_float(as_uint(x) & splat(0x7F800000u)); }
HWY_INLINE FloatVec largest_of(const V3& v) { return max(max(abs(v.x), abs(v.y)), abs(v.z)); }
HWY_INLINE FloatVec sum_of_magnitudes(const V3& v) { return abs(v.x) + abs(v.y) + abs(v.z); }

HWY_INLINE V3 canonical_of(const V3& d) {
    const FloatVec largest = largest_of(d);
    const FloatVec to_unit = as_float(splat(0x7F000000u) - as_uint(exponent_of(largest)));
    const FloatVec s = select(largest > splat(0.0f), to_unit, splat(1.0f));
    return snap3(times(d, s), kDirectionOnGrid, kDirectionSnap);
}

HWY_INLINE V3 unit_of(const V3& v) {
    const FloatVec largest = largest_of(v);
    const FloatVec s = zero_unless(largest > splat(0.0f), rcp_of_positive(largest));
    const V3 w = times(v, s);
    return times(w, rsqrt_of(dot_of(w, w)));
}

/// camera_ray().dir of the pixels whose middles these are.
HWY_INLINE V3 camera_directions(const Camera& camera, FloatVec px, FloatVec py) {
    const auto along = [&](int axis) HWY_ATTR {
        return splat(camera.corner[axis]) + splat(camera.du[axis]) * px +
               splat(camera.dv[axis]) * py;
    };
    return canonical_of({along(0), along(1), along(2)});
}

HWY_INLINE SurfaceLanes surfaces_at(vec3 org, const V3& dir, FloatVec t, const V3 corners[3]) {
    const V3 travel{t * dir.x, t * dir.y, t * dir.z};
    SurfaceLanes s;
    s.point = plus(splat3(org), travel);
    const V3 across = cross_of(minus(corners[1], corners[0]), minus(corners[2], corners[0]));
    const Mask some = largest_of(across) > splat(0.0f);
    const V3 n = unit_of(select(some, across, dir));
    const Mask away = dot_of(n, dir) > splat(0.0f);
    s.normal = select(away, {-n.x, -n.y, -n.z}, n);
    s.size = sum_of_magnitudes(s.point) + sum_of_magnitudes(travel);
    return s;
}

HWY_INLINE V3 off_surfaces(const SurfaceLanes& s, FloatVec size) {
    const FloatVec offset = splat(kSurfaceOffset) * size;
    return snap3(plus(s.point, times(s.normal, offset)), kCoordinateOnGrid, kCoordinateSnap);
}

HWY_INLINE DirectionLanes shadow_rays(const SurfaceLanes& s, const V3& to_light, vec3 light) {
    const FloatVec size = s.size + sum_of_magnitudes(to_light);
    const V3 dir = minus(off_surfaces(s, size), splat3(light));
    return {canonical_of(dir), exponent_of(largest_of(dir))};
}

HWY_INLINE UintVec mixed_bits(UintVec x) {
    const UintVec state = x * splat(747796405u) + splat(2891336453u);
    const UintVec shift = shift_right<28>(state) + splat(4u);
    const UintVec word = (hn::Shr(state, shift) ^ state) * splat(277803737u);
    return shift_right<22>(word) ^ word;
}

HWY_INLINE FloatVec signed_units(UintVec x) {
    const FloatVec f = as_float(shift_right<9>(x) | splat(0x3F800000u));
    return splat(2.0f) * f - splat(3.0f);
}

/// ao_ray() of the surfaces that pixels (x, y) show, but for the origin.
HWY_INLINE DirectionLanes ao_rays(const SurfaceLanes& s, UintVec x, UintVec y, std::uint32_t sample,
                                  float tfar) {
    UintVec seed = mixed_bits(x + mixed_bits(y + splat(mix_bits(sample))));
    V3 drawn = s.normal;
    FloatVec drawn_length2 = splat(0.0f);
    Mask more = drawn_length2 == drawn_length2;
    for (int attempt = 0; attempt < 8 && !none(more); ++attempt) {
        V3 point;
        seed = mixed_bits(seed);
        point.x = signed_units(seed);
        seed = mixed_bits(seed);
        point.y = signed_units(seed);
        seed = mixed_bits(seed);
        point.z = signed_units(seed);
        const FloatVec length2 = dot_of(point, point);
        drawn = select(more, point, drawn);
        const Mask in_ball = (length2 <= splat(1.0f)) & (length2 > splat(0.0009765625f));
        drawn_length2 = select(more & in_ball, length2, drawn_length2);
        more = drawn_length2 == splat(0.0f);
    }
    const Mask is_drawn = drawn_length2 > splat(0.0f);
    const FloatVec l =
        splat(0.9990234375f) * rsqrt_of(select(is_drawn, drawn_length2, splat(1.0f)));
    const V3 dir = select(is_drawn, unit_of(plus(s.normal, times(drawn, l))), s.normal);
    return {canonical_of(dir), splat(tfar) * exponent_of(largest_of(dir))};
}

/// The intensity of what light reaches, given the cosine between its normal and the light.
HWY_INLINE FloatVec lit_intensity(FloatVec facing) {
    return splat(0.125f) + splat(0.875f) * facing;
}

HWY_INLINE UintVec encoded_channel(FloatVec x) {
    const FloatVec c = min(max(x, splat(0.0f)), splat(1.0f));
    const FloatVec root = zero_unless(c > splat(0.00000095367431640625f), c * rsqrt_of(c));
    const FloatVec scaled = root * splat(255.0f) + splat(0.5f);
    return as_uint(hn::ConvertTo(hn::RebindToSigned<FloatTag>(), scaled));
}

HWY_INLINE UintVec colours_of(FloatVec intensity, UintVec albedo) {
    const FloatVec k = intensity * splat(0.0039215688593685626983642578125f);
    const auto channel = [&](UintVec bits) HWY_ATTR {
        return encoded_channel(hn::ConvertTo(kFloats, as_int(bits & splat(0xFFu))) * k);
    };
    const UintVec r = channel(albedo);
    const UintVec g = channel(shift_right<8>(albedo));
    const UintVec b = channel(shift_right<16>(albedo));
    return r | shift_left<8>(g) | (shift_left<16>(b) | splat(0xFF000000u));
}

}  // namespace HWY_NAMESPACE
}  // namespace morphray::cpu
HWY_AFTER_NAMESPACE();

#endif
