// From a hit and its occlusion to an 8-bit colour, in the same exact operations.
#if !defined(COMMON_INTEROP_SHADING_H) || defined(SHARED_LANES)
#ifndef COMMON_INTEROP_SHADING_H
#define COMMON_INTEROP_SHADING_H

#include "common/interop/params.h"
#include "common/interop/surface.h"

#endif

SHARED_BEGIN

#ifndef SHARED_LANES
// The intensity of a point that the light does not reach.
SHARED_CONST float kUnlitIntensity = 0.125f;
#endif

/// Linear intensity in [0, 1] to 8 bits with gamma 2, rounding up from 1 - rounding, in (0, 1).
SHARED Uint encode_channel(Float x, Float rounding) {
    PRECISE Float c = lesser(greater(x, 0.0f), 1.0f);
    PRECISE Float root = select(c > 0.00000095367431640625f, c * rsqrt(c), 0.0f);  // 2^-20
    PRECISE Float scaled = root * 255.0f + rounding;
    return to_uint(scaled);
}

/// The same, rounding to nearest.
SHARED Uint encode_channel(Float x) { return encode_channel(x, broadcast(0.5f)); }

/// R in bits 0-7, then G, B and 255 for opaque.
SHARED Uint pack_rgb(Uint r, Uint g, Uint b) { return r | (g << 8u) | (b << 16u) | 0xFF000000u; }

/// The intensity of a point that the light reaches, from the cosine between normal and light.
SHARED Float lit_intensity(Float facing) {
    PRECISE Float r = kUnlitIntensity + 0.875f * facing;
    return r;
}

/// One linear channel of a colour; its linear albedo is 0 to 255.
SHARED Float channel_of(Float intensity, Uint albedo) {
    PRECISE Float k = intensity * 0.0039215688593685626983642578125f;  // 1/255
    PRECISE Float c = to_float(albedo) * k;
    return c;
}

/// albedo is packed as by pack_rgb, linear.
SHARED Uint colour_of(Float intensity, Uint albedo) {
    return pack_rgb(encode_channel(channel_of(intensity, albedo & 0xFFu)),
                    encode_channel(channel_of(intensity, (albedo >> 8u) & 0xFFu)),
                    encode_channel(channel_of(intensity, (albedo >> 16u) & 0xFFu)));
}

#ifndef SHARED_LANES

/// Behind the scene: a vertical blend of two greys.
SHARED uint background(uint y, uint height) {
    uint s = (64u * y) / height;
    return pack_rgb(58u + s / 2u, 62u + s / 2u, 72u + s / 2u);
}

/// The colour of a hit. albedo is packed as by pack_rgb, linear. occlusion is the number of
/// occluded secondary rays (0 or 1 for a shadow ray, 0 to ao_count for ambient occlusion).
SHARED uint shade(ImageParams params, Ray ray, Surface s, uint albedo, uint occlusion) {
    PRECISE float intensity = 0.0f;
    if (params.rays == kRaysAo) {
        PRECISE float open = float(params.ao_count - occlusion);
        intensity = open * rcp_of_positive(float(params.ao_count));
    } else {
        // One unit vector for both: some devices compute all branches.
        bool is_shadow = params.rays == kRaysShadow;
        PRECISE vec3 to_light = params.light - s.point;
        vec3 towards = unit(is_shadow ? to_light : ray.dir);
        PRECISE float cosine = dot3(s.normal, towards);
        PRECISE float facing = is_shadow ? greater(cosine, 0.0f) : abs(cosine);
        bool is_lit = !is_shadow || occlusion == 0u;
        intensity = is_lit ? lit_intensity(facing) : kUnlitIntensity;
    }
    return colour_of(intensity, albedo);
}

#endif

SHARED_END

#endif  // per Float type
