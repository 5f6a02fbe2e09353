// Hits of rays, one ray a lane: their number, in the answer's first word, with kCountTouches if one may
// be at an edge or a vertex; or the first hit after a cursor, whose t is the ray's tnear. Each ray's
// word of kBindVisiblePixels is the lowest prim_id of the hits at tnear that count.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/kernel.glsl"
#include "common/interop/tie_break_rule.h"
#include "common/interop/slab.h"
#include "shaders/queries/visits.glsl"

READ4(Rays, rays, kBindRays);
READ1(FirstPrims, first_prims, kBindVisiblePixels);

Ray ray;
uint first_prim;
SlabRay slab;
ShearedRay sheared;

/// Hits beyond it do not count.
float least_t() {
    bool is_first = (args.flags & kQueryCount) == 0u && answer.w != kNoPrim;
    return is_first ? uintBitsToFloat(answer.x) : ray.tfar;
}

bool meets(vec3 lower, vec3 upper, out int key) {
    float t_least;
    bool is_met = hits_box(slab, lower, upper, t_least);
    key = floatBitsToInt(t_least);
    return is_met && t_least <= last_depth(least_t());
}

int last_key() { return floatBitsToInt(last_depth(least_t())); }

uint test_triangle(vec3 a, vec3 b, vec3 c, uint prim_id) {
    TriangleHit hit;
    if (!intersect_triangle(sheared, ray.tnear, ray.tfar, a, b, c, hit)) return 0u;
    if ((args.flags & kQueryTieBreak) != 0u && !owns_hit(sheared, a, b, c, hit)) return 0u;
    if ((args.flags & kQueryCount) != 0u) {
        answer.x += 1u + count_repeats(prim_id);
        if (may_touch_border(hit.u, hit.v)) answer.x |= kCountTouches;
        return kRepeatsSteps;
    }
    // The lowest of the equal triangles that counts.
    if (hit.t == ray.tnear && prim_id < first_prim) prim_id = first_repeat(prim_id, first_prim);
    if (prim_id != kNoPrim && is_closer(hit.t, prim_id, least_t(), answer.w)) {
        answer = uvec4(floatBitsToUint(hit.t), floatBitsToUint(hit.u), floatBitsToUint(hit.v),
                       prim_id);
    }
    return kRepeatsSteps;
}

void main() {
    uint query;
    if (!find_query(query)) return;
    ray = ray_from(AT4(rays, 2u * query), AT4(rays, 2u * query + 1u));
    first_prim = AT1(first_prims, query);
    slab = slab_ray(ray.org, ray.dir);
    sheared = shear_ray(ray.org, ray.dir);
    answer = uvec4(0u);
    if ((args.flags & kQueryCount) == 0u) answer.w = kNoPrim;
    answer_query(query);
}
