// From a hit and its occlusion to an 8-bit colour: of ordinary images; of lit images, with a light,
// the sky and smooth normals; and false colours. In the same exact operations as all results.
#if !defined(COMMON_INTEROP_SHADING_H) || defined(SHARED_LANES)
#ifndef COMMON_INTEROP_SHADING_H
#define COMMON_INTEROP_SHADING_H

#include "common/interop/camera.h"
#include "common/interop/surface.h"

#endif

SHARED_BEGIN

#ifndef SHARED_LANES
// The intensity of a point that the light does not reach.
SHARED_CONST float kUnlitIntensity = 0.125f;
// A bit of a packed albedo: the triangle shows the background, darkened where light is kept off.
SHARED_CONST uint kShadowCatcherBit = 0x01000000u;
// Another bit: the triangle has a texture.
SHARED_CONST uint kTexturedBit = 0x02000000u;
// Kinds of images: plain ones by shade(), lit ones by lit_sample(), others by false_colour().
SHARED_CONST uint kLitPlain = 0u;
SHARED_CONST uint kLitLit = 1u;
SHARED_CONST uint kLitNormal = 2u;
SHARED_CONST uint kLitDepth = 3u;
SHARED_CONST uint kLitPrim = 4u;
// Behind the scene in false colours.
SHARED_CONST uint kNoColour = 0xFF000000u;
// Lit images average occlusion over a square of kAoSquareSide samples a side, which begins this
// many before a sample on each axis.
SHARED_CONST uint kAoSquareBefore = 1u;
#endif

/// Linear intensity in [0, 1] to 8 bits with gamma 2, rounding up from 1 - rounding, in (0, 1).
SHARED Uint encode_channel(Float x, Float rounding) {
    PRECISE Float c = lesser(greater(x, 0.0f), 1.0f);
    PRECISE Float root = select(c > 0.00000095367431640625f, c * rsqrt(c), 0.0f);  // 2^-20
    PRECISE Float scaled = root * 255.0f + rounding;
    return to_uint(scaled);
}

/// Rounds to nearest.
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

// ---- Lit images and false colours

/// The normal of a triangle's corner for smooth shading: the vertex normal n, on the side of the
/// triangle's own normal `flat_normal`, or that itself at a crease of more than 37 degrees.
SHARED Float3 corner_normal(Float3 n, Float3 flat_normal) {
    Float facing = dot3(n, flat_normal);
    Float3 towards = select(facing < 0.0f, -n, n);
    return select(abs(facing) >= 0.800000011920928955078125f, towards, flat_normal);
}

/// The unit normal at (u, v) of a triangle with these normals at its corners.
SHARED Float3 smooth_normal(Float3 a, Float3 b, Float3 c, Float u, Float v) {
    PRECISE Float w = (1.0f - u) - v;
    PRECISE Float3 n = Float3((w * a.x + u * b.x) + v * c.x, (w * a.y + u * b.y) + v * c.y,
                              (w * a.z + u * b.z) + v * c.z);
    return unit(n);
}

/// How far p lies below the plane through a with the unit normal n, along n; 0 above it.
SHARED Float3 lift_to_plane(Float3 p, Float3 a, Float3 n) {
    PRECISE Float3 from = p - a;
    PRECISE Float height = -lesser(dot3(from, n), 0.0f);
    PRECISE Float3 lift = Float3(n.x * height, n.y * height, n.z * height);
    return lift;
}

/// The surface that the normals at the corners of a triangle suggest, above its flat surface s at
/// (u, v): the mean of s.point, lifted to the planes that touch the surface at the corners (J.
/// Hanika. Hacking the shadow terminator. Ray Tracing Gems II, 2021). a, b, c: the corners; na, nb,
/// nc: their unit normals, on the side of s.normal.
SHARED Surface smooth_surface(Surface s, Float3 a, Float3 b, Float3 c, Float3 na, Float3 nb,
                              Float3 nc, Float u, Float v) {
    Float3 from_a = lift_to_plane(s.point, a, na);
    Float3 from_b = lift_to_plane(s.point, b, nb);
    Float3 from_c = lift_to_plane(s.point, c, nc);
    PRECISE Float w = (1.0f - u) - v;
    PRECISE Float3 lift = Float3((w * from_a.x + u * from_b.x) + v * from_c.x,
                                 (w * from_a.y + u * from_b.y) + v * from_c.y,
                                 (w * from_a.z + u * from_b.z) + v * from_c.z);
    PRECISE Float3 point = s.point + lift;
    PRECISE Float size = s.size + sum_of_abs(lift);
    Surface above;
    above.point = point;
    above.normal = smooth_normal(na, nb, nc, u, v);
    above.size = size;
    return above;
}

/// Whether a sample that is in shadow has to be asked again: the smooth surface above its flat one
/// is another and faces the light.
SHARED Bool may_see_light(Surface flat_surface, Surface above, Float3 light) {
    PRECISE Float3 to_light = light - flat_surface.point;
    Float3 a = flat_surface.point;
    Float3 b = above.point;
    return dot3(above.normal, to_light) > 0.0f && !(a.x == b.x && a.y == b.y && a.z == b.z);
}

#ifndef SHARED_LANES
/// From just off surface a to just off surface b.
SHARED Ray ray_between(Surface a, Surface b) {
    Ray ray;
    ray.org = off_surface(a, a.size);
    ray.tnear = 0.0f;
    PRECISE vec3 dir = off_surface(b, b.size) - ray.org;
    ray.dir = canonical_direction(dir);
    ray.tfar = power_of_two_below(largest_component(dir));
    return ray;
}
#endif

/// The depth along the viewing direction of a hit at t of a camera ray; `through`:
/// camera_direction().
SHARED Float depth_of(Float t, Float3 through) {
    PRECISE Float depth = t * scale_to_unit(largest_component(through));
    return depth;
}

/// Where the camera ray with that direction has a depth.
SHARED Float3 point_at_depth(Float3 org, Float3 through, Float depth) {
    PRECISE Float3 p =
        Float3(org.x + depth * through.x, org.y + depth * through.y, org.z + depth * through.z);
    return p;
}

/// The plane of a sample's triangle, for samples beside it: the products of its normal with the
/// sample's ray and with the steps to the next ones, and how far they may be from the plane.
struct SamplePlane {
    Float3 normal;
    Float along, along_x, along_y;
    Float offset, most;
};

SHARED SamplePlane sample_plane(Camera camera, Float3 normal, Float3 through, Float depth) {
    Float3 du = Float3(camera.du);
    SamplePlane p;
    p.normal = normal;
    p.along = dot3(normal, through);
    p.along_x = dot3(normal, du);
    p.along_y = dot3(normal, Float3(camera.dv));
    PRECISE Float offset = p.along * depth;
    PRECISE Float most = depth * (4.0f * largest_component(du));
    p.offset = offset;
    p.most = most;
    return p;
}

/// Whether the sample that is (x, y) away lies in nearly the same plane, by its normal and by its
/// distance, up to four samples. A sample without a hit has a depth of 0 or less.
SHARED Bool is_in_plane(SamplePlane p, float x, float y, Float3 normal, Float depth) {
    PRECISE Float beside = (p.along + p.along_y * y) + p.along_x * x;
    PRECISE Float apart = abs(beside * depth - p.offset);
    return depth > 0.0f && dot3(p.normal, normal) >= 0.75f && apart <= p.most;
}

/// The share of `occluded` of `count` rays that are open; both are sums of whole numbers.
SHARED Float openness(Float occluded, Float count) {
    // The reciprocal may be rounded up, so that all of them are more than 1.
    PRECISE Float r = 1.0f - occluded * rcp_of_positive(count);
    return greater(r, broadcast(0.0f));
}

/// a at 0, b at 1.
SHARED Float blend(Float a, Float b, Float x) {
    PRECISE Float r = a + x * (b - a);
    return r;
}

/// Linear colour to 8 bits a channel, with the rounding of encode_channel().
SHARED Uint encode_rgb(Float3 c, Float rounding) {
    return pack_rgb(encode_channel(c.x, rounding), encode_channel(c.y, rounding),
                    encode_channel(c.z, rounding));
}

/// Rounds to nearest.
SHARED Uint encode_rgb(Float3 c) { return encode_rgb(c, broadcast(0.5f)); }

/// The rounding of the background's colour at pixel (x, y). The 16 pixels of a square of
/// kAoSquareSide round differently, so that its mean has 16 times as many steps as a pixel.
SHARED Float dithered_rounding(Uint x, Uint y) {
    PRECISE Float r = to_float(ao_number(x, y, 0u)) * 0.0625f + 0.03125f;
    return r;
}

/// The square root of a mean of squares of 8-bit channels, rounded to the nearest whole number,
/// upwards from the middle. Exact: the mean is a multiple of 1/64 up to 255^2, and the squares that
/// it is compared with are floats.
SHARED Uint root_of_mean(Float mean) {
    Float positive = greater(mean, 0.0078125f);
    PRECISE Float guess = positive * rsqrt(positive) + 0.5f;
    Float root = to_float(to_uint(guess));
    PRECISE Float below = (root * root - root) + 0.25f;
    PRECISE Float above = (root * root + root) + 0.25f;
    PRECISE Float less = root - 1.0f;
    PRECISE Float more = root + 1.0f;
    Float corrected = select(mean >= above, more, select(mean < below && root > 0.0f, less, root));
    return to_uint(corrected);
}

/// The colour of a pixel by the squares of the channels of its samples: their sums, times 1 over
/// the number of samples.
SHARED Uint mean_colour(Uint r, Uint g, Uint b, float share) {
    PRECISE Float mean_r = to_float(r) * share;
    PRECISE Float mean_g = to_float(g) * share;
    PRECISE Float mean_b = to_float(b) * share;
    return pack_rgb(root_of_mean(mean_r), root_of_mean(mean_g), root_of_mean(mean_b));
}

#ifndef SHARED_LANES
/// 1 over the number of samples of a pixel, a square with a side of 1, 2, 4 or 8.
SHARED float sample_share(uint side) {
    return side == 1u ? 1.0f : side == 2u ? 0.25f : side == 4u ? 0.0625f : 0.015625f;
}

/// How far below the top row y of an image is, from 0 to 1.
SHARED float image_height(uint y, uint height) {
    PRECISE float at = (to_float(y) + 0.5f) * rcp_of_positive(to_float(height));
    return at;
}
#endif

/// The linear colour that an albedo stands for, which is packed as by pack_rgb, linear.
SHARED Float3 albedo_colour(Uint albedo) {
    PRECISE Float k = broadcast(0.0039215688593685626983642578125f);  // 1/255
    PRECISE Float3 c = Float3(to_float(albedo & 0xFFu) * k, to_float((albedo >> 8u) & 0xFFu) * k,
                              to_float((albedo >> 16u) & 0xFFu) * k);
    return c;
}

/// The linear colour `base` multiplied by that of a texture, whose channels are whole numbers from
/// 0 to 65025.
SHARED Float3 textured_colour(Float3 base, Float3 texture) {
    PRECISE Float k = broadcast(0.00001537870048196054995059967041015625f);  // 1/65025
    PRECISE Float3 c =
        Float3(base.x * (texture.x * k), base.y * (texture.y * k), base.z * (texture.z * k));
    return c;
}

/// The linear colour of a surface with the unit normal n under a warm light and a sky. to_light:
/// the unit direction to the light; light: 1, or 0 in its shadow; open: the share of the sky that
/// the surface sees; up: the unit vector upwards; base: the share of light that it gives back.
SHARED Float3 lit_colour(Float3 n, Float3 to_light, Float light, Float open, Float3 up,
                         Float3 base) {
    PRECISE Float sun = greater(dot3(n, to_light), 0.0f) * light;
    PRECISE Float lift = 0.5f + 0.5f * dot3(n, up);
    PRECISE Float r = 0.9375f * sun + open * blend(broadcast(0.125f), broadcast(0.3125f), lift);
    PRECISE Float g = 0.875f * sun + open * blend(broadcast(0.109375f), broadcast(0.34375f), lift);
    PRECISE Float b =
        0.765625f * sun + open * blend(broadcast(0.09375f), broadcast(0.40625f), lift);
    PRECISE Float3 c = Float3(base.x * r, base.y * g, base.z * b);
    return c;
}

/// The linear colour behind the scene at a height from 0 (top of the image) to 1.
SHARED Float3 sky_colour(Float height) {
    PRECISE Float x = height * (2.0f - height);
    return Float3(blend(broadcast(0.28125f), broadcast(0.75f), x),
                  blend(broadcast(0.3359375f), broadcast(0.75f), x),
                  blend(broadcast(0.421875f), broadcast(0.734375f), x));
}

/// The linear colour of a surface that shows the background, with light and open as in
/// lit_colour().
SHARED Float3 shadow_catcher_colour(Float height, Float light, Float open) {
    PRECISE Float k = (0.53125f + 0.46875f * light) * (0.25f + 0.75f * open);
    Float3 c = sky_colour(height);
    PRECISE Float3 darkened = Float3(c.x * k, c.y * k, c.z * k);
    return darkened;
}

/// A hit in lit images and false colours. The unit normals to shade with and of the triangle are on
/// the side of the eye; `through` is camera_direction(), depth is along it.
struct ShownHit {
    Float3 normal, flat_normal, through;
    Float depth;
    Uint prim;
};

/// A linear colour and the rounding to 8 bits of encode_channel().
struct SampleColour {
    Float3 linear;
    Float rounding;
};

/// Behind the scene; dithered: dithered_rounding().
SHARED SampleColour sky_sample(Float height, Float dithered) {
    SampleColour c;
    c.linear = sky_colour(height);
    c.rounding = dithered;
    return c;
}

/// A hit of a lit image, whose camera is at org. `light`, `open` and `base` are those of
/// lit_colour(), height and dithered those of sky_sample(); albedo is packed.
SHARED SampleColour lit_sample(ShownHit s, Float3 org, Float3 light_at, Float3 up, Float light,
                               Float open, Uint albedo, Float3 base, Float height, Float dithered) {
    PRECISE Float3 to_light = light_at - point_at_depth(org, s.through, s.depth);
    Float3 lit = lit_colour(s.normal, unit(to_light), light, open, up, base);
    Float3 darkened = shadow_catcher_colour(height, light, open);
    Uint bit = albedo & kShadowCatcherBit;
    SampleColour c;
    c.linear = select(bit == kShadowCatcherBit, darkened, lit);
    c.rounding = select(bit == kShadowCatcherBit, dithered, broadcast(0.5f));
    return c;
}

/// A unit normal as a colour: -1 to 1 on each axis is 0 to 255.
SHARED Uint normal_colour(Float3 n) {
    PRECISE Float x = 127.5f * n.x + 128.0f;
    PRECISE Float y = 127.5f * n.y + 128.0f;
    PRECISE Float z = 127.5f * n.z + 128.0f;
    return pack_rgb(to_uint(x), to_uint(y), to_uint(z));
}

/// A depth as a grey: white up to depth `near`, darker in proportion to the distance from there,
/// 1/16 (linear) from near + 15/16 / per_depth on.
SHARED Uint depth_colour(Float depth, Float near, Float per_depth) {
    PRECISE Float k = 1.0f - (depth - near) * per_depth;
    Float grey = lesser(greater(k, 0.0625f), 1.0f);
    return encode_rgb(Float3(grey, grey, grey));
}

/// A colour for a triangle, different for most, shaded by the cosine between normal and ray.
SHARED Uint prim_colour(Uint prim, Float cosine) {
    Uint hash = mix_bits(prim);
    PRECISE Float k = 0.25f + 0.75f * abs(cosine);
    return colour_of(k, hash | 0x202020u);
}

/// A hit in false colours of a kind. near, per_depth: those of depth_colour().
SHARED Uint false_colour(uint kind, ShownHit s, Float near, Float per_depth) {
    if (kind == kLitDepth) return depth_colour(s.depth, near, per_depth);
    if (kind == kLitPrim) return prim_colour(s.prim, dot3(s.flat_normal, unit(s.through)));
    return normal_colour(s.normal);
}

SHARED_END

#endif  // per Float type
