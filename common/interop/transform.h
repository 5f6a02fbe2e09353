// The affine map of a mesh that follows a matrix: p becomes M p + t.
#ifndef COMMON_INTEROP_TRANSFORM_H
#define COMMON_INTEROP_TRANSFORM_H

#include "common/interop/arithmetic.h"

SHARED_BEGIN

/// The three rows (m0, m1, m2, t).
struct Transform {
    vec4 x;
    vec4 y;
    vec4 z;
};

/// Each coordinate is ((m0 * x + m1 * y) + m2 * z) + t, with each operation rounded.
SHARED vec3 transform_point(Transform m, vec3 p) {
    PRECISE vec3 moved =
        vec3(dot3(vec3(m.x), p) + m.x.w, dot3(vec3(m.y), p) + m.y.w, dot3(vec3(m.z), p) + m.z.w);
    return moved;
}

SHARED_END

#endif  // COMMON_INTEROP_TRANSFORM_H
