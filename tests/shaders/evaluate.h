// All shared functions of one case, for C++ and GLSL.
#ifndef TESTS_SHADERS_EVALUATE_H
#define TESTS_SHADERS_EVALUATE_H

#include "common/interop/camera.h"
#include "common/interop/hit_rule.h"
#include "common/interop/shading.h"

SHARED_BEGIN

SHARED_CONST uint kAnswers = 21u;
/// The answer of the hit rule: the word beside t, u and v.
SHARED_CONST uint kHitAnswer = 7u;

/// A ray and a triangle, a surface, a box, a camera, and numbers of other sizes; without padding.
struct Inputs {
    Ray ray;
    vec3 a;
    float x;
    vec3 b;
    float t;
    vec3 c;
    float ao_tfar;
    vec3 point;
    float size;
    vec3 normal;
    uint rays;
    vec3 box_lower;
    uint ao_count;
    vec3 box_upper;
    uint occluded;
    vec3 mixed_sizes;
    uint albedo;
    vec3 light;
    uint ao_index;
    Camera camera;
    uvec4 pixel;
};

struct Outputs {
    uvec4 word[kAnswers];
};

SHARED uvec4 words(vec3 v, uint w) {
    return uvec4(floatBitsToUint(v.x), floatBitsToUint(v.y), floatBitsToUint(v.z), w);
}
SHARED uvec4 words(vec3 v, float w) { return words(v, floatBitsToUint(w)); }

SHARED Outputs evaluate(Inputs i) {
    Outputs o;
    float size = abs(i.x);
    o.word[0] = words(vec3(rcp(i.x), rsqrt(size), scale_to_unit(size)), power_of_two_below(size));
    o.word[1] = words(cross3(i.a, i.b), dot3(i.a, i.b));
    o.word[2] = words(cross3(i.a, i.normal), dot3(i.a, i.normal));
    o.word[3] = words(unit(i.b), sum_of_abs(i.a));
    o.word[4] = words(snap_point(i.mixed_sizes), 0u);
    o.word[5] = words(canonical_direction(i.mixed_sizes), 0u);
    float t_least;
    SlabRay slab = slab_ray(i.ray.org, i.ray.dir);
    uint meets = hits_box(slab, i.box_lower, i.box_upper, t_least) ? 1u : 0u;

    ShearedRay s = shear_ray(i.ray.org, i.ray.dir);
    TriangleHit found;
    bool is_hit = intersect_triangle(s, i.ray.tnear, i.ray.tfar, i.a, i.b, i.c, found);
    Hit hit = make_hit(found, 7u);
    o.word[6] = words(vec3(t_least, 0.0f, 0.0f), meets);
    o.word[kHitAnswer] = words(vec3(hit.t, hit.u, hit.v), is_hit ? 1u : 0u);
    o.word[8] = words(project_fast(s, i.a), may_hit_triangle(s, i.a, i.b, i.c) ? 1u : 0u);
    o.word[9] = words(project(s, i.a), 0u);
    o.word[10] = words(project(s, i.b), 0u);

    Ray ray = camera_ray(i.camera, i.pixel.x, i.pixel.y);
    o.word[11] = words(ray.org, ray.tnear);
    o.word[12] = words(ray.dir, ray.tfar);
    hit = no_hit();
    hit.t = i.t;
    Surface seen = surface_at(i.ray, hit, i.a, i.b, i.c);
    o.word[13] = words(seen.point, seen.size);
    o.word[14] = words(seen.normal, camera_depth_scale(i.camera, i.pixel.x, i.pixel.y));
    o.word[15] = words(off_surface(seen, seen.size), 0u);

    Surface surface;
    surface.point = i.point;
    surface.normal = i.normal;
    surface.size = i.size;
    ray = shadow_ray(surface, i.light);
    o.word[16] = words(ray.org, ray.tnear);
    o.word[17] = words(ray.dir, ray.tfar);
    ray = ao_ray(surface, i.pixel.x, i.pixel.y, i.ao_index, i.ao_tfar);
    o.word[18] = words(ray.org, ray.tnear);
    o.word[19] = words(ray.dir, ray.tfar);
    ImageParams params;
    params.light = i.light;
    params.rays = i.rays;
    params.ao_count = i.ao_count;
    uint colour = shade(params, i.ray, surface, i.albedo, i.occluded);
    uint behind = background(i.pixel.z % 5000u, 5000u);
    o.word[20] = uvec4(colour, behind, faces_light(surface, i.light) ? 1u : 0u, 0u);
    return o;
}

SHARED_END

#endif  // TESTS_SHADERS_EVALUATE_H
