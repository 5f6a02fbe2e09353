// Boxes of the scene, and the places that primitives may have in it.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>

#include "morphray/geometry.hpp"

namespace mray::embree {

/// Whether a primitive may have this vertex. Embree leaves out those with others, which are no
/// numbers, or so far away that squares of lengths overflow.
inline bool is_in_range(const morphray::Vec3& p) {
    constexpr float kLimit = 1.844e18f;
    return std::abs(p.x) < kLimit && std::abs(p.y) < kLimit && std::abs(p.z) < kLimit;
}

/// A box; lower > upper if nothing is in it.
struct Bounds {
    std::array<float, 3> lower = {kInfinity, kInfinity, kInfinity};
    std::array<float, 3> upper = {-kInfinity, -kInfinity, -kInfinity};

    void add(const morphray::Vec3& p) { add({{p.x, p.y, p.z}, {p.x, p.y, p.z}}); }
    void add(const Bounds& other) {
        for (std::size_t axis = 0; axis < 3; ++axis) {
            lower[axis] = std::min(lower[axis], other.lower[axis]);
            upper[axis] = std::max(upper[axis], other.upper[axis]);
        }
    }
    /// The squared distance of a point.
    float distance2(const std::array<float, 3>& point) const {
        float sum = 0;
        for (std::size_t axis = 0; axis < 3; ++axis) {
            const float beside =
                std::max({lower[axis] - point[axis], 0.0f, point[axis] - upper[axis]});
            sum += beside * beside;
        }
        return sum;
    }

private:
    static constexpr float kInfinity = std::numeric_limits<float>::infinity();
};

}  // namespace mray::embree
