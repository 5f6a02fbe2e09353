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

SHARED float transform_coordinate(vec4 row, vec3 p) {
    PRECISE float moved = dot3(vec3(row), p) + row.w;
    return moved;
}

/// Each coordinate is ((m0 * x + m1 * y) + m2 * z) + t, with each operation rounded.
SHARED vec3 transform_point(Transform transform, vec3 p) {
    return vec3(transform_coordinate(transform.x, p), transform_coordinate(transform.y, p),
                transform_coordinate(transform.z, p));
}

SHARED_END

#endif  // COMMON_INTEROP_TRANSFORM_H
