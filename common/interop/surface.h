// The surface at a hit, and the secondary rays that start there.
#if !defined(COMMON_INTEROP_SURFACE_H) || defined(SHARED_LANES)
#ifndef COMMON_INTEROP_SURFACE_H
#define COMMON_INTEROP_SURFACE_H

#include "common/interop/arithmetic.h"
#include "common/interop/ray.h"

#endif

SHARED_BEGIN

#ifndef SHARED_LANES
// Ambient occlusion is sampled equally in all squares of this many pixels a side, each pixel of a
// square in other directions: the mean over any such square has no noise.
SHARED_CONST uint kAoSquareSide = 4u;
#endif

/// A hit point, the unit geometric normal on the side that the ray came from, and a bound of the
/// sizes that entered the point's computation (the scale of its rounding error). The normal of a
/// triangle whose edges have no cross product points against the ray.
struct Surface {
    Float3 point, normal;
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

/// A hit at t of a ray on a triangle with this unit normal, on either side.
SHARED Surface surface_with(Float3 org, Float3 dir, Float t, Float3 n) {
    PRECISE Float3 travel = Float3(t * dir.x, t * dir.y, t * dir.z);
    PRECISE Float3 point = org + travel;
    PRECISE Float size = sum_of_abs(point) + sum_of_abs(travel);
    Surface s;
    s.point = point;
    s.normal = select(dot3(n, dir) > 0.0f, -n, n);
    s.size = size;
    return s;
}

/// A hit at t of a ray; a, b, c: the vertices of the triangle, in scene space.
SHARED Surface surface_of(Float3 org, Float3 dir, Float t, Float3 a, Float3 b, Float3 c) {
    PRECISE Float3 bma = b - a;
    PRECISE Float3 cma = c - a;
    Float3 across = cross3(bma, cma);
    return surface_with(org, dir, t, unit(select(largest_component(across) > 0.0f, across, dir)));
}

/// The point moved off the surface along its normal by kSurfaceOffset * size, on the coordinate
/// grid: where secondary rays start or end. Checked: lab/proofs/surface_offset.g.
SHARED Float3 off_surface(Surface s, Float size) {
    PRECISE Float offset = kSurfaceOffset * size;
    PRECISE Float3 p = Float3(s.point.x + s.normal.x * offset, s.point.y + s.normal.y * offset,
                              s.point.z + s.normal.z * offset);
    return snap_point(p);
}

/// Whether the light is on the visible side; if not, the point is in shadow without a ray.
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

/// The number of a direction for ambient-occlusion ray `sample_index` of pixel (x, y). Each number
/// occurs once in a square; neighbours have numbers far apart (B. E. Bayer. An optimum method for
/// two-level rendition of continuous-tone pictures. 1973).
SHARED Uint ao_number(Uint x, Uint y, uint sample_index) {
    Uint d = x ^ y;
    Uint place = ((d & 1u) << 3u) | ((y & 1u) << 2u) | (d & 2u) | ((y & 2u) >> 1u);
    return place + sample_index * (kAoSquareSide * kAoSquareSide);
}

/// Point n of a sequence that fills the unit sphere evenly: the additive recurrence of the plastic
/// number (M. Roberts. The unreasonable effectiveness of quasirandom sequences. 2018), with z and
/// the angle around the z axis as coordinates.
SHARED Float3 sphere_point(Uint n) {
    Uint u = n * 3242174889u + 2147483648u;
    Uint v = n * 2447445414u + 2147483648u;
    PRECISE Float z = signed_unit(u);
    PRECISE Float radius2 = 1.0f - z * z;
    PRECISE Float radius =
        select(radius2 > 0.00000095367431640625f, radius2 * rsqrt(radius2), 0.0f);  // 2^-20
    // Two bits are the quadrant, others an angle in [-pi/4, pi/4); Taylor's errors are below 4e-6.
    PRECISE Float a = signed_unit(v << 2u) * 0.785398185253143310546875f;
    PRECISE Float a2 = a * a;
    PRECISE Float s2 =
        0.008333333767950534820556640625f - a2 * 0.000198412701138295233249664306640625f;
    PRECISE Float s1 = a2 * s2 - 0.16666667163372039794921875f;
    PRECISE Float sine = a + a * (a2 * s1);
    PRECISE Float c2 = 0.0416666679084300994873046875f - a2 * 0.001388888922519981861114501953125f;
    PRECISE Float c1 = a2 * c2 - 0.5f;
    PRECISE Float cosine = 1.0f + a2 * c1;
    Uint quadrant = v >> 30u;
    Float x = select((quadrant & 1u) == 1u, sine, cosine);
    Float y = select((quadrant & 1u) == 1u, cosine, sine);
    x = select(((quadrant + 1u) & 2u) == 2u, -x, x);
    y = select((quadrant & 2u) == 2u, -y, y);
    PRECISE Float3 p = Float3(radius * x, radius * y, z);
    return p;
}

/// The direction to a point of the unit sphere around the normal's tip, given by its place on the
/// sphere. Not canonical. Even points give directions distributed by the cosine to the normal.
SHARED Float3 ao_direction(Surface s, Float3 point) {
    // Slightly less than 1, so that a point opposite to the normal still gives a direction.
    PRECISE Float3 lifted =
        Float3(s.normal.x + 0.9990234375f * point.x, s.normal.y + 0.9990234375f * point.y,
               s.normal.z + 0.9990234375f * point.z);
    return unit(lifted);
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

/// Ambient-occlusion ray `sample_index` of pixel (x, y), of length tfar.
SHARED Ray ao_ray(Surface s, uint x, uint y, uint sample_index, float tfar) {
    vec3 dir = ao_direction(s, sphere_point(ao_number(x, y, sample_index)));
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
