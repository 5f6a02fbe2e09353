// Exact crossings: of a half-line that floats cannot decide, of rays through edges or vertices.
#pragma once

#include "common/interop/ray.h"
#include "common/scene/mesh.h"

namespace mray {

/// How the half-line from a point along +z meets a triangle.
struct ExactCrossing {
    /// 1 if it leaves the side that the triangle is counter-clockwise from, -1 the other, else 0.
    int sign = 0;
    /// Whether the point lies on the triangle, which has its border.
    bool is_on_triangle = false;
};

/// The crossing of a finite point p and a triangle of finite vertices, in any space: exact, by
/// signs of determinants, in some microseconds. The half-line is moved by less than any distance,
/// to that of p + (e, e^2, e^3), e -> 0 (H. Edelsbrunner, E. P. Mücke. Simulation of Simplicity.
/// ACM TOG 9(1), 1990), so that it crosses one of the triangles around an edge or a vertex.
/// docs/design/arithmetic.md, "Inside".
ExactCrossing exact_crossing(vec3 p, vec3 a, vec3 b, vec3 c);

/// Keeps of the hits through one edge or vertex of a mesh the first, and all through the inside of
/// a triangle. `hits` are all that the ray has by the hit rule, in the order of (t, prim_id), so
/// that the closest one stays. Edges and vertices are one if they lie at one place in one mesh,
/// whose first prim_id is in `first_prims`. That a ray goes through them is exact.
void keep_one_of_each_crossing(const Topology& topology, std::span<const vec3> positions,
                               std::span<const std::uint32_t> first_prims, const Ray& ray,
                               std::vector<Hit>& hits);

}  // namespace mray
