// Rays and hits in scene space, as all tracers take and return them.
#ifndef COMMON_INTEROP_RAY_H
#define COMMON_INTEROP_RAY_H

#include "common/interop/constants.h"
#include "common/interop/platform.h"

SHARED_BEGIN

/// A ray org + t * dir, t > 0, tnear <= t <= tfar. org is on the coordinate grid, |org| <= 2^40 per
/// axis; dir is canonical: its largest component has magnitude in [1, 2), and all are multiples of
/// 2^-46 (a zero dir hits nothing). tnear >= 0; tfar is finite (kInfiniteT stands for infinity).
struct Ray {
    vec3 org;
    float tnear;
    vec3 dir;
    float tfar;
};

/// t: ray parameter. u, v: barycentric weights of the triangle's second and third vertex.
/// A miss is {0, 0, 0, kNoPrim}.
struct Hit {
    float t, u, v;
    uint prim_id;
};

SHARED Hit no_hit() {
    Hit h;
    h.t = 0.0f;
    h.u = 0.0f;
    h.v = 0.0f;
    h.prim_id = kNoPrim;
    return h;
}

SHARED_END

#ifdef __cplusplus
static_assert(sizeof(mray::Ray) == 32 && sizeof(mray::Hit) == 16);
#endif

#endif  // COMMON_INTEROP_RAY_H
