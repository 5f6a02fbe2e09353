// Every shared function with inputs and outputs as words, for C++ and GLSL.
#ifndef TESTS_SHADERS_EVALUATE_H
#define TESTS_SHADERS_EVALUATE_H

#include "common/interop/camera.h"
#include "common/interop/hit_rule.h"
#include "common/interop/shading.h"

SHARED_BEGIN

SHARED_CONST uint kInputWords = 24u;
SHARED_CONST uint kOutputWords = 12u;

struct Inputs {
    uint word[24];
};
struct Outputs {
    uint word[12];
};

SHARED_CONST uint kEvalReciprocals = 0u;
SHARED_CONST uint kEvalProducts = 1u;
SHARED_CONST uint kEvalSnap = 2u;
SHARED_CONST uint kEvalBox = 3u;
SHARED_CONST uint kEvalMayHit = 4u;
SHARED_CONST uint kEvalTriangle = 5u;
SHARED_CONST uint kEvalProject = 6u;
SHARED_CONST uint kEvalCamera = 7u;
SHARED_CONST uint kEvalSurface = 8u;
SHARED_CONST uint kEvalShadowRay = 9u;
SHARED_CONST uint kEvalAoRay = 10u;
SHARED_CONST uint kEvalShade = 11u;
SHARED_CONST uint kEvalCount = 12u;

SHARED float number(Inputs i, uint at) { return uintBitsToFloat(i.word[at]); }
SHARED vec3 vector(Inputs i, uint at) {
    return vec3(number(i, at), number(i, at + 1u), number(i, at + 2u));
}

SHARED Surface surface_from(Inputs i, uint at) {
    Surface s;
    s.point = vector(i, at);
    s.normal = vector(i, at + 3u);
    s.size = number(i, at + 6u);
    return s;
}

SHARED Ray ray_from(Inputs i, uint at) {
    Ray ray;
    ray.org = vector(i, at);
    ray.tnear = number(i, at + 3u);
    ray.dir = vector(i, at + 4u);
    ray.tfar = number(i, at + 7u);
    return ray;
}

SHARED Outputs no_outputs() {
    Outputs o;
    for (uint k = 0u; k < kOutputWords; ++k) o.word[k] = 0u;
    return o;
}

SHARED Outputs with_vector(Outputs o, uint at, vec3 v) {
    o.word[at] = floatBitsToUint(v.x);
    o.word[at + 1u] = floatBitsToUint(v.y);
    o.word[at + 2u] = floatBitsToUint(v.z);
    return o;
}

SHARED Outputs with_ray(Outputs o, Ray ray) {
    o = with_vector(o, 0u, ray.org);
    o.word[3] = floatBitsToUint(ray.tnear);
    o = with_vector(o, 4u, ray.dir);
    o.word[7] = floatBitsToUint(ray.tfar);
    return o;
}

SHARED Outputs evaluate_arithmetic(uint function, Inputs i) {
    Outputs o = no_outputs();
    if (function == kEvalReciprocals) {
        o.word[0] = floatBitsToUint(rcp(number(i, 0u)));
        o.word[1] = floatBitsToUint(rsqrt(abs(number(i, 0u))));
        o.word[2] = floatBitsToUint(scale_to_unit(abs(number(i, 0u))));
        o.word[3] = floatBitsToUint(power_of_two_below(abs(number(i, 0u))));
    } else if (function == kEvalProducts) {
        o.word[0] = floatBitsToUint(dot3(vector(i, 0u), vector(i, 3u)));
        o = with_vector(o, 1u, cross3(vector(i, 0u), vector(i, 3u)));
        o.word[4] = floatBitsToUint(sum_of_abs(vector(i, 0u)));
        o = with_vector(o, 5u, unit(vector(i, 3u)));
    } else if (function == kEvalSnap) {
        o = with_vector(o, 0u, snap_point(vector(i, 0u)));
        o = with_vector(o, 3u, canonical_direction(vector(i, 0u)));
    } else if (function == kEvalBox) {
        float t_least;
        SlabRay s = slab_ray(vector(i, 0u), vector(i, 3u));
        o.word[0] = hits_box(s, vector(i, 6u), vector(i, 9u), t_least) ? 1u : 0u;
        o.word[1] = floatBitsToUint(t_least);
    }
    return o;
}

SHARED Outputs evaluate_triangle(uint function, Inputs i) {
    Outputs o = no_outputs();
    Ray ray = ray_from(i, 0u);
    ShearedRay s = shear_ray(ray.org, ray.dir);
    vec3 a = vector(i, 8u);
    vec3 b = vector(i, 11u);
    vec3 c = vector(i, 14u);
    if (function == kEvalMayHit) {
        o.word[0] = may_hit_triangle(s, a, b, c) ? 1u : 0u;
        o = with_vector(o, 1u, project_fast(s, a));
    } else if (function == kEvalTriangle) {
        TriangleHit hit;
        bool is_hit = intersect_triangle(s, ray.tnear, ray.tfar, a, b, c, hit);
        o.word[0] = is_hit ? 1u : 0u;
        Hit h = make_hit(hit, 7u);
        o = with_vector(o, 1u, vec3(h.t, h.u, h.v));
    } else if (function == kEvalProject) {
        o = with_vector(o, 0u, project(s, a));
        o = with_vector(o, 3u, project(s, b));
    }
    return o;
}

SHARED Outputs evaluate_camera(Inputs i) {
    Camera camera;
    camera.org = vector(i, 0u);
    camera.corner = vector(i, 3u);
    camera.du = vector(i, 6u);
    camera.dv = vector(i, 9u);
    Outputs o = with_ray(no_outputs(), camera_ray(camera, i.word[12], i.word[13]));
    o.word[8] = floatBitsToUint(camera_depth_scale(camera, i.word[12], i.word[13]));
    return o;
}

SHARED Outputs evaluate_surface(Inputs i) {
    Hit hit = no_hit();
    hit.t = number(i, 17u);
    Surface s = surface_at(ray_from(i, 0u), hit, vector(i, 8u), vector(i, 11u), vector(i, 14u));
    Outputs o = with_vector(no_outputs(), 0u, s.point);
    o = with_vector(o, 3u, s.normal);
    o.word[6] = floatBitsToUint(s.size);
    return with_vector(o, 7u, off_surface(s, s.size));
}

SHARED Outputs evaluate_shade(Inputs i) {
    ImageParams params;
    params.light = vector(i, 0u);
    params.rays = i.word[3];
    params.ao_count = i.word[4];
    Outputs o = no_outputs();
    o.word[0] = shade(params, ray_from(i, 5u), surface_from(i, 13u), i.word[20], i.word[21]);
    o.word[1] = background(i.word[22] % 5000u, 5000u);
    return o;
}

SHARED Outputs evaluate(uint function, Inputs i) {
    Outputs o = no_outputs();
    if (function <= kEvalBox) {
        o = evaluate_arithmetic(function, i);
    } else if (function <= kEvalProject) {
        o = evaluate_triangle(function, i);
    } else if (function == kEvalCamera) {
        o = evaluate_camera(i);
    } else if (function == kEvalSurface) {
        o = evaluate_surface(i);
    } else if (function == kEvalShadowRay) {
        Surface s = surface_from(i, 0u);
        o = with_ray(o, shadow_ray(s, vector(i, 7u)));
        o.word[8] = faces_light(s, vector(i, 7u)) ? 1u : 0u;
    } else if (function == kEvalAoRay) {
        o = with_ray(o,
                     ao_ray(surface_from(i, 0u), i.word[7], i.word[8], i.word[9], number(i, 10u)));
    } else if (function == kEvalShade) {
        o = evaluate_shade(i);
    }
    return o;
}

SHARED_END

#endif  // TESTS_SHADERS_EVALUATE_H
