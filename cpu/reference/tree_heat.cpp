#include "cpu/reference/tree_heat.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <glm/geometric.hpp>

#include "common/interop/constants.h"
#include "common/interop/slab.h"

namespace mray::cpu {
namespace {

using glm::dvec3;

dvec3 position(const LeafVertex& v) { return {v.x, v.y, v.z}; }

float looseness_of(const Leaf& leaf) {
    const std::uint32_t count = corner_triangle_count(leaf.vertex[0].corners);
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    dvec3 lower(kInfinity);
    dvec3 upper(-kInfinity);
    double area = 0;
    for (std::uint32_t i = 0; i < count; ++i) {
        dvec3 corners[3];
        bool is_finite = true;
        for (std::uint32_t k = 0; k < 3; ++k) {
            corners[k] = position(leaf.vertex[corner(leaf.vertex[i].corners, k)]);
            is_finite = is_finite && corners[k].x != double{kInvalidCoordinate};
        }
        if (!is_finite) continue;
        for (const dvec3& p : corners) {
            lower = glm::min(lower, p);
            upper = glm::max(upper, p);
        }
        const dvec3 across = glm::cross(corners[1] - corners[0], corners[2] - corners[0]);
        area += std::sqrt(glm::dot(across, across));
    }
    const dvec3 size = upper - lower;
    if (!(size.x >= 0)) return 0;
    const double box = 2 * (size.x * size.y + size.y * size.z + size.z * size.x);
    constexpr double kMost = std::numeric_limits<float>::max();
    return static_cast<float>(area > 0 ? std::min(box / area, kMost) : kMost);
}

}  // namespace

std::uint32_t count_steps(const Bvh& bvh, const Ray& ray, const Hit& hit) {
    const SlabRay slab = slab_ray(ray.org, ray.dir);
    const float last = last_depth(hit.prim_id != kNoPrim ? hit.t : ray.tfar);
    std::uint32_t stack[kMaxStack];
    std::uint32_t size = 0;
    stack[size++] = 0;
    std::uint32_t steps = 0;
    while (size > 0) {
        const std::uint32_t child = stack[--size];
        ++steps;
        if ((child & kLeafBit) != 0) continue;
        const Node& node = bvh.nodes[child];
        for (std::uint32_t slot = 0; slot < kWidth && node.child[slot] != kEmptyChild; ++slot) {
            const vec3 lower = {node.lower_x[slot], node.lower_y[slot], node.lower_z[slot]};
            const vec3 upper = {node.upper_x[slot], node.upper_y[slot], node.upper_z[slot]};
            float t_least;
            if (hits_box(slab, lower, upper, t_least) && t_least <= last)
                stack[size++] = node.child[slot];
        }
    }
    return steps;
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
