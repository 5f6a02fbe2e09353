// The closest point of a triangle in plain floats, as peers find and store it.
#pragma once

#include <cstdint>

#include <glm/geometric.hpp>

#include "common/interop/ray.h"

namespace mray::lab {

/// The point of a scene that is closest to the point of a query.
struct NearestPoint {
    vec3 point;
    float distance;
    std::uint32_t prim_id;
};

/// The point of the triangle a, b, c that is closest to p, in plain floats (C. Ericson. Real-Time
/// Collision Detection, 2005, 5.1.5).
inline vec3 ericson_closest_point(vec3 p, vec3 a, vec3 b, vec3 c) {
    const vec3 ab = b - a;
    const vec3 ac = c - a;
    const vec3 ap = p - a;
    const float d1 = glm::dot(ab, ap);
    const float d2 = glm::dot(ac, ap);
    if (d1 <= 0 && d2 <= 0) return a;
    const vec3 bp = p - b;
    const float d3 = glm::dot(ab, bp);
    const float d4 = glm::dot(ac, bp);
    if (d3 >= 0 && d4 <= d3) return b;
    const float vc = d1 * d4 - d3 * d2;
    if (vc <= 0 && d1 >= 0 && d3 <= 0) return a + (d1 / (d1 - d3)) * ab;
    const vec3 cp = p - c;
    const float d5 = glm::dot(ab, cp);
    const float d6 = glm::dot(ac, cp);
    if (d6 >= 0 && d5 <= d6) return c;
    const float vb = d5 * d2 - d1 * d6;
    if (vb <= 0 && d2 >= 0 && d6 <= 0) return a + (d2 / (d2 - d6)) * ac;
    const float va = d3 * d6 - d5 * d4;
    if (va <= 0 && d4 >= d3 && d5 >= d6) return b + ((d4 - d3) / ((d4 - d3) + (d5 - d6))) * (c - b);
    const float scale = 1 / (va + vb + vc);
    return a + (vb * scale) * ab + (vc * scale) * ac;
}

}  // namespace mray::lab
