// Nodes whose boxes are small integers on a grid of the node's own (H. Ylitie, T. Karras, S. Laine.
// Efficient Incoherent Ray Traversal on GPUs Through Compressed Wide BVHs. 2017), over the leaves
// of the shared layout. Every box contains the original box, so answers stay the same.
#pragma once

#include <cmath>
#include <concepts>
#include <limits>
#include <vector>

#include "common/bvh/box.h"
#include "lab/accuracy/methods/plain_traversal.h"

namespace mray::accuracy {

/// Plane i of an axis is at origin + i * step. step is a power of two, so only the sum rounds.
template <std::unsigned_integral Grid>
struct QuantisedNode {
    float origin[3];
    float step[3];
    Grid lower[3][kWidth];
    Grid upper[3][kWidth];
    uint child[kWidth];

    float plane(std::size_t axis, Grid i) const {
        return origin[axis] + static_cast<float>(i) * step[axis];
    }
};

template <std::unsigned_integral Grid>
QuantisedNode<Grid> quantised(const Node& node) {
    constexpr int kMost = std::numeric_limits<Grid>::max();
    QuantisedNode<Grid> result{};
    const Box whole = node_box(node);
    for (std::size_t axis = 0; axis < 3; ++axis) {
        const int a = static_cast<int>(axis);
        if (whole.empty()) break;
        result.origin[axis] = whole.lower[a];
        // A step of at least the coordinates' ulp, or sums would not reach every plane.
        const float ulp = std::max(std::abs(whole.lower[a]), std::abs(whole.upper[a])) * 0x1p-23f;
        int exponent;
        std::frexp(std::max((whole.upper[a] - whole.lower[a]) / (kMost - 1), ulp), &exponent);
        result.step[axis] = std::ldexp(1.0f, exponent);
    }
    for (std::uint32_t slot = 0; slot < kWidth; ++slot) {
        result.child[slot] = node.child[slot];
        const Box box = slot_box(node, slot);
        for (std::size_t axis = 0; axis < 3 && !box.empty(); ++axis) {
            const int a = static_cast<int>(axis);
            const float lower = (box.lower[a] - result.origin[axis]) / result.step[axis];
            const float upper = (box.upper[a] - result.origin[axis]) / result.step[axis];
            auto& i = result.lower[axis][slot];
            auto& j = result.upper[axis][slot];
            i = static_cast<Grid>(std::floor(lower));
            j = static_cast<Grid>(std::ceil(upper));
            while (i > 0 && result.plane(axis, i) > box.lower[a]) --i;
            while (j < kMost && result.plane(axis, j) < box.upper[a]) ++j;
        }
    }
    return result;
}

/// The dilated boxes of scene space, decoded.
class QuantisedSlabs {
public:
    explicit QuantisedSlabs(const Ray& ray) : slab_(slab_ray(ray.org, ray.dir)) {}

    template <std::unsigned_integral Grid>
    bool meets(const QuantisedNode<Grid>& node, std::uint32_t slot, float& t_enter) const {
        const vec3 lower(node.plane(0, node.lower[0][slot]), node.plane(1, node.lower[1][slot]),
                         node.plane(2, node.lower[2][slot]));
        const vec3 upper(node.plane(0, node.upper[0][slot]), node.plane(1, node.upper[1][slot]),
                         node.plane(2, node.upper[2][slot]));
        return hits_box(slab_, lower, upper, t_enter);
    }
    float last_entry(float t) const { return last_depth(t); }

private:
    SlabRay slab_;
};

template <std::unsigned_integral Grid>
std::vector<QuantisedNode<Grid>> quantised_nodes(const Bvh& bvh) {
    std::vector<QuantisedNode<Grid>> nodes;
    for (const Node& node : bvh.nodes) nodes.push_back(quantised<Grid>(node));
    return nodes;
}

}  // namespace mray::accuracy
