// The surface at a hit, and the secondary rays that start there.
#if !defined(COMMON_INTEROP_SURFACE_H) || defined(SHARED_LANES)
#ifndef COMMON_INTEROP_SURFACE_H
#define COMMON_INTEROP_SURFACE_H

#include "common/interop/arithmetic.h"
#include "common/interop/ray.h"

#endif

SHARED_BEGIN

#ifndef SHARED_LANES
// How often a point is drawn for an ambient-occlusion ray.
SHARED_CONST uint kAoAttempts = 8u;
#endif

/// A hit point, the unit geometric normal on the side that the ray came from, and a bound of the
/// sizes that entered the point's computation (the scale of its rounding error). The normal of a
/// triangle whose edges have no cross product points against the ray.
struct Surface {
    Float3 point;
    Float3 normal;
    Float size;
};

SHARED Float sum_of_abs(Float3 v) {
    PRECISE Float r = (abs(v.x) + abs(v.y)) + abs(v.z);
    return r;
}

/// v scaled to length 1; 0 stays 0.
SHARED Float3 unit(Float3 v) {
    Float largest = largest_component(v);
    Float s = select(largest > 0.0f, rcp_of_positive(largest), 0.0f);
    PRECISE Float3 w = Float3(v.x * s, v.y * s, v.z * s);
    PRECISE Float l = rsqrt(dot3(w, w));
    PRECISE Float3 r = Float3(w.x * l, w.y * l, w.z * l);
    return r;
}

/// A hit at t of a ray; a, b, c: the vertices of the triangle, in scene space.
SHARED Surface surface_of(Float3 org, Float3 dir, Float t, Float3 a, Float3 b, Float3 c) {
    PRECISE Float3 travel = Float3(t * dir.x, t * dir.y, t * dir.z);
    PRECISE Float3 point = org + travel;
    PRECISE Float3 bma = b - a;
    PRECISE Float3 cma = c - a;
    Float3 across = cross3(bma, cma);
    Float3 n = unit(select(largest_component(across) > 0.0f, across, dir));
    PRECISE Float size = sum_of_abs(point) + sum_of_abs(travel);
    Surface s;
    s.point = point;
    s.normal = select(dot3(n, dir) > 0.0f, -n, n);
    s.size = size;
    return s;
}

/// The point moved off the surface along its normal by kSurfaceOffset * size, on the coordinate
/// grid: where secondary rays start or end.
/// Checked: proofs/surface_offset.g.
SHARED Float3 off_surface(Surface s, Float size) {
    PRECISE Float offset = kSurfaceOffset * size;
    PRECISE Float3 p = Float3(s.point.x + s.normal.x * offset, s.point.y + s.normal.y * offset,
                              s.point.z + s.normal.z * offset);
    return snap_point(p);
}

/// Whether the light is on the visible side of the surface. If not, the point is in shadow without
/// a ray.
SHARED Bool faces_light(Surface s, Float3 light) {
    PRECISE Float3 to_light = light - s.point;
    return dot3(s.normal, to_light) > 0.0f;
}

/// The direction from the light to just off the surface, not canonical.
SHARED Float3 shadow_direction(Surface s, Float3 light) {
    PRECISE Float3 to_light = light - s.point;
    PRECISE Float size = s.size + sum_of_abs(to_light);
    PRECISE Float3 dir = off_surface(s, size) - light;
    return dir;
}

/// A bijective mix of 32 bits (M. E. O'Neill. PCG: a family of simple fast space-efficient
/// statistically good algorithms for random number generation. 2014; the RXS-M-XS output step).
SHARED Uint mix_bits(Uint x) {
    Uint state = x * 747796405u + 2891336453u;
    Uint word = ((state >> ((state >> 28u) + 4u)) ^ state) * 277803737u;
    return (word >> 22u) ^ word;
}

/// 23 bits of x as a float in [-1, 1).
SHARED Float signed_unit(Uint x) {
    PRECISE Float f = uintBitsToFloat((x >> 9u) | 0x3F800000u);
    PRECISE Float r = 2.0f * f - 3.0f;
    return r;
}

/// The seed of an ambient-occlusion ray, from its pixel (x, y) and mix_bits() of its sample's
/// index.
SHARED Uint ao_seed(Uint x, Uint y, uint sample_bits) {
    return mix_bits(x + mix_bits(y + sample_bits));
}

/// The next point of the cube [-1, 1)^3.
SHARED Float3 draw_point(INOUT(Uint) seed) {
    seed = mix_bits(seed);
    PRECISE Float x = signed_unit(seed);
    seed = mix_bits(seed);
    PRECISE Float y = signed_unit(seed);
    seed = mix_bits(seed);
    PRECISE Float z = signed_unit(seed);
    return Float3(x, y, z);
}

/// The squared length of a point of the unit ball; 0 outside, and close to the centre.
SHARED Float ball_length2(Float3 p) {
    PRECISE Float length2 = dot3(p, p);
    return select(length2 <= 1.0f && length2 > 0.0009765625f, length2, 0.0f);
}

/// The direction to the point in direction `drawn` on the unit sphere around the normal's tip,
/// given drawn_length2 = ball_length2(drawn); the normal itself if that is 0. Not canonical.
SHARED Float3 ao_direction(Surface s, Float3 drawn, Float drawn_length2) {
    // Slightly less than 1, so that a point opposite to the normal still gives a direction.
    Bool is_drawn = drawn_length2 > 0.0f;
    PRECISE Float l = 0.9990234375f * rsqrt(select(is_drawn, drawn_length2, 1.0f));
    PRECISE Float3 lifted =
        Float3(s.normal.x + drawn.x * l, s.normal.y + drawn.y * l, s.normal.z + drawn.z * l);
    return select(is_drawn, unit(lifted), s.normal);
}

#ifndef SHARED_LANES

SHARED Surface surface_at(Ray ray, Hit hit, vec3 a, vec3 b, vec3 c) {
    return surface_of(ray.org, ray.dir, hit.t, a, b, c);
}

/// From the light (all shadow rays of an image share that origin) to just off the surface.
SHARED Ray shadow_ray(Surface s, vec3 light) {
    vec3 dir = shadow_direction(s, light);
    Ray ray;
    ray.org = light;
    ray.tnear = 0.0f;
    ray.dir = canonical_direction(dir);
    ray.tfar = power_of_two_below(largest_component(dir));
    return ray;
}

/// Ambient-occlusion ray `sample_index` of pixel (x, y): cosine-distributed about the normal (a
/// point on the unit sphere around its tip), length tfar. The point is drawn from a cube at most
/// kAoAttempts times until it lies in the ball; after that (3 in 1000) the normal itself is taken.
SHARED Ray ao_ray(Surface s, uint x, uint y, uint sample_index, float tfar) {
    uint seed = ao_seed(x, y, mix_bits(sample_index));
    vec3 drawn = s.normal;
    float drawn_length2 = 0.0f;
    uint attempt = 0u;
    do {
        // Always true; shaders/base/cluster.glsl says why it is tested.
        if (drawn_length2 == 0.0f && attempt < kAoAttempts) {
            drawn = draw_point(seed);
            drawn_length2 = ball_length2(drawn);
        }
        ++attempt;
    } while (drawn_length2 == 0.0f && attempt < kAoAttempts);
    vec3 dir = ao_direction(s, drawn, drawn_length2);
    PRECISE float end = tfar * power_of_two_below(largest_component(dir));
    Ray ray;
    ray.org = off_surface(s, s.size);
    ray.tnear = 0.0f;
    ray.dir = canonical_direction(dir);
    ray.tfar = end;
    return ray;
}

#endif

SHARED_END

#endif  // per Float type
