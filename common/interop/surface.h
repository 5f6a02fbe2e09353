// Where a hit lies, and the secondary rays that start from there.
#ifndef COMMON_INTEROP_SURFACE_H
#define COMMON_INTEROP_SURFACE_H

#include "common/interop/arithmetic.h"
#include "common/interop/ray.h"

SHARED_BEGIN

/// A hit point, the unit geometric normal on the side that the ray came from, and a bound of the
/// sizes that entered the point's computation (the scale of its rounding error). The normal of a
/// triangle whose edges have no cross product points against the ray.
struct Surface {
    vec3 point;
    vec3 normal;
    float size;
};

SHARED float sum_of_abs(vec3 v) {
    PRECISE float r = (abs(v.x) + abs(v.y)) + abs(v.z);
    return r;
}

/// v scaled to length 1; 0 stays 0.
SHARED vec3 unit(vec3 v) {
    float largest = largest_component(v);
    float s = largest > 0.0f ? rcp(largest) : 0.0f;
    PRECISE vec3 w = vec3(v.x * s, v.y * s, v.z * s);
    PRECISE float l = rsqrt(dot3(w, w));
    PRECISE vec3 r = vec3(w.x * l, w.y * l, w.z * l);
    return r;
}

/// a, b, c: the vertices of the triangle that was hit, in scene space.
SHARED Surface surface_at(Ray ray, Hit hit, vec3 a, vec3 b, vec3 c) {
    PRECISE vec3 travel = vec3(hit.t * ray.dir.x, hit.t * ray.dir.y, hit.t * ray.dir.z);
    PRECISE vec3 point = ray.org + travel;
    PRECISE vec3 bma = b - a;
    PRECISE vec3 cma = c - a;
    vec3 across = cross3(bma, cma);
    vec3 n = unit(largest_component(across) > 0.0f ? across : ray.dir);
    bool away = dot3(n, ray.dir) > 0.0f;
    n = away ? -n : n;
    PRECISE float size = sum_of_abs(point) + sum_of_abs(travel);
    Surface s;
    s.point = point;
    s.normal = n;
    s.size = size;
    return s;
}

/// The point moved off the surface along its normal by kSurfaceOffset * size, on the coordinate
/// grid: where secondary rays start or end.
/// Checked: proofs/surface_offset.g.
SHARED vec3 off_surface(Surface s, float size) {
    PRECISE float offset = kSurfaceOffset * size;
    PRECISE vec3 p = vec3(s.point.x + s.normal.x * offset, s.point.y + s.normal.y * offset,
                          s.point.z + s.normal.z * offset);
    return snap_point(p);
}

/// Whether the light is on the side of the surface that was seen. If not, the point is in shadow
/// without a ray.
SHARED bool faces_light(Surface s, vec3 light) {
    PRECISE vec3 to_light = light - s.point;
    return dot3(s.normal, to_light) > 0.0f;
}

/// From the light (all shadow rays of an image share that origin) to just off the surface.
SHARED Ray shadow_ray(Surface s, vec3 light) {
    PRECISE vec3 to_light = light - s.point;
    PRECISE float size = s.size + sum_of_abs(to_light);
    PRECISE vec3 dir = off_surface(s, size) - light;
    Ray ray;
    ray.org = light;
    ray.tnear = 0.0f;
    ray.dir = canonical_direction(dir);
    ray.tfar = power_of_two_below(largest_component(dir));
    return ray;
}

/// A bijective mix of 32 bits (M. E. O'Neill. PCG: a family of simple fast space-efficient
/// statistically good algorithms for random number generation. 2014; the RXS-M-XS output step).
SHARED uint mix_bits(uint x) {
    uint state = x * 747796405u + 2891336453u;
    uint word = ((state >> ((state >> 28u) + 4u)) ^ state) * 277803737u;
    return (word >> 22u) ^ word;
}

/// 23 bits of x as a float in [-1, 1).
SHARED float signed_unit(uint x) {
    PRECISE float f = uintBitsToFloat((x >> 9u) | 0x3F800000u);
    PRECISE float r = 2.0f * f - 3.0f;
    return r;
}

/// Ambient-occlusion ray `sample_index` of pixel (x, y): cosine-distributed about the normal (a
/// point on the unit sphere around its tip), length tfar. The point is drawn from a cube and
/// redrawn up to 8 times until it lies in the ball; after that (3 in 1000) the normal itself is
/// taken.
SHARED Ray ao_ray(Surface s, uint x, uint y, uint sample_index, float tfar) {
    uint seed = mix_bits(x + mix_bits(y + mix_bits(sample_index)));
    vec3 drawn = s.normal;
    float drawn_length2 = 0.0f;
    uint attempt = 0u;
    do {
        // Always so, but see shaders/base/cluster.glsl.
        if (drawn_length2 == 0.0f && attempt < 8u) {
            seed = mix_bits(seed);
            PRECISE float rx = signed_unit(seed);
            seed = mix_bits(seed);
            PRECISE float ry = signed_unit(seed);
            seed = mix_bits(seed);
            PRECISE float rz = signed_unit(seed);
            drawn = vec3(rx, ry, rz);
            PRECISE float length2 = dot3(drawn, drawn);
            drawn_length2 = length2 <= 1.0f && length2 > 0.0009765625f ? length2 : 0.0f;
        }
        ++attempt;
    } while (drawn_length2 == 0.0f && attempt < 8u);
    // A hair less than 1, so that a point opposite to the normal still gives a direction.
    bool is_drawn = drawn_length2 > 0.0f;
    PRECISE float l = 0.9990234375f * rsqrt(is_drawn ? drawn_length2 : 1.0f);
    PRECISE vec3 lifted =
        vec3(s.normal.x + drawn.x * l, s.normal.y + drawn.y * l, s.normal.z + drawn.z * l);
    vec3 towards = unit(lifted);
    vec3 dir = is_drawn ? towards : s.normal;
    PRECISE float end = tfar * power_of_two_below(largest_component(dir));
    Ray ray;
    ray.org = off_surface(s, s.size);
    ray.tnear = 0.0f;
    ray.dir = canonical_direction(dir);
    ray.tfar = end;
    return ray;
}

SHARED_END

#endif  // COMMON_INTEROP_SURFACE_H
