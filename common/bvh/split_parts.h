// What all ways of dividing a set of triangles have in common.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>

#include "common/bvh/prim_ref.h"

namespace morphray {

/// The cheapest place found so far.
struct Split {
    float cost = std::numeric_limits<float>::infinity();
    int axis = 0;
    std::size_t position = 0;
    std::size_t left_size = 0;

    void consider(const Split& other) {
        if (other.cost < cost) *this = other;
    }
};

// What a part costs besides its triangles, in triangle tests: the node that it is in. Trees come
// out 0.4 to 2 % cheaper than with 0; still more makes cheaper ones, but of smaller leaves
// (docs/layout.md, "Building and refitting").
inline constexpr float kPartCost = 12;

/// What a part of a split costs: half its area (0 if it is empty) times what is in it.
inline float part_cost(const Box4& box, std::size_t count) {
    const float4 d = box.extent();
    const float4 products = d * __builtin_shufflevector(d, d, 1, 2, 0, 3);
    return (products[0] + products[1] + products[2]) *
           (static_cast<float>(static_cast<std::int32_t>(count)) + kPartCost);
}

inline Box4 centroid_bounds(std::span<const PrimRef> refs) {
    // Two, so that neither waits for the other.
    Box4 bounds[2] = {Box4::none(), Box4::none()};
    const auto add = [&](std::size_t i) {
        if (!refs[i].empty()) bounds[i % 2].extend(refs[i].centroid2());
    };
    for (std::size_t i = 0; i + 1 < refs.size(); i += 2) {
        add(i);
        add(i + 1);
    }
    if (refs.size() % 2 != 0) add(refs.size() - 1);
    bounds[0].extend(bounds[1]);
    return bounds[0];
}

/// Writes refs to `out` from left_index on if `goes_left`, else from right_index on. No branch on
/// what is as good as random.
template <class GoesLeft>
void partition(std::span<const PrimRef> refs, PrimRef* out, std::size_t left_index,
               std::size_t right_index, GoesLeft goes_left) {
    for (const PrimRef& ref : refs) {
        const std::size_t is_left = goes_left(ref) ? 1 : 0;
        out[right_index ^ ((left_index ^ right_index) & -is_left)] = ref;
        left_index += is_left;
        right_index += 1 - is_left;
    }
}

}  // namespace morphray
