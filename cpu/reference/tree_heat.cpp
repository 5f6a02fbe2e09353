#include "cpu/reference/tree_heat.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <glm/geometric.hpp>

#include "common/interop/constants.h"
#include "cpu/reference/scalar_tracer.h"

namespace mray::cpu {
namespace {

using glm::dvec3;

float looseness_of(const Leaf& leaf) {
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    dvec3 lower(kInfinity);
    dvec3 upper(-kInfinity);
    double area = 0;
    for_each_triangle(leaf, [&](vec3 a, vec3 b, vec3 c, std::uint32_t) {
        if (!finite_vertices(a, b, c)) return;
        for (const dvec3 p : {dvec3(a), dvec3(b), dvec3(c)}) {
            lower = glm::min(lower, p);
            upper = glm::max(upper, p);
        }
        const dvec3 across = glm::cross(dvec3(b) - dvec3(a), dvec3(c) - dvec3(a));
        area += std::sqrt(glm::dot(across, across));
    });
    const dvec3 size = upper - lower;
    if (!(size.x >= 0)) return 0;
    const double box = 2 * (size.x * size.y + size.y * size.z + size.z * size.x);
    constexpr double kMost = std::numeric_limits<float>::max();
    return static_cast<float>(area > 0 ? std::min(box / area, kMost) : kMost);
}

}  // namespace

std::uint32_t count_steps(const Bvh& bvh, const Ray& ray, const Hit& hit) {
    const float last = last_depth(hit.prim_id != kNoPrim ? hit.t : ray.tfar);
    return for_each_near_leaf(bvh, ray, last, [last](const Leaf&) { return last; });
}

std::vector<float> leaf_looseness(const Bvh& bvh) {
    std::vector<float> looseness(bvh.triangle_count, 0.0f);
    for (const Leaf& leaf : bvh.leaves) {
        const float value = looseness_of(leaf);
        for (const std::uint32_t prim : leaf.prim_id)
            if (prim != kNoPrim) looseness[prim] = value;
    }
    return looseness;
}

}  // namespace mray::cpu
