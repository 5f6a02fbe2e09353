// Crossings of a half-line that floats cannot decide, in exact integers.
#pragma once

#include "common/interop/platform.h"

namespace mray {

/// How the half-line from a point along +z meets a triangle.
struct ExactCrossing {
    /// 1 if it crosses it and leaves the side that the triangle is counter-clockwise from, -1 if it
    /// leaves the other one, else 0.
    int sign = 0;
    /// Whether the point lies on the triangle, which has its border.
    bool is_on_triangle = false;
};

/// The crossing of a finite point p and a triangle of finite vertices, in any space. Exact: the
/// signs of determinants of their coordinates decide. The half-line is moved by less than any
/// distance, to that of p + (e, e^2, e^3), e -> 0 (H. Edelsbrunner, E. P. Mücke. Simulation of
/// Simplicity. ACM TOG 9(1), 1990): of the triangles around an edge or a vertex that it passes
/// through it crosses one, and a point on the surface is its moved neighbour. Takes some
/// microseconds. docs/design/arithmetic.md, "Inside".
ExactCrossing exact_crossing(vec3 p, vec3 a, vec3 b, vec3 c);

}  // namespace mray
