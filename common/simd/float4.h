// Four floats in one register: GNU vector types, which g++ and clang compile for every machine.
// Only + - *, comparisons and selections, so that no bit depends on the width or the compiler.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>

#include "common/bvh/box.h"

namespace morphray {

using float4 __attribute__((vector_size(16))) = float;
using int4 __attribute__((vector_size(16))) = std::int32_t;

inline float4 min(float4 a, float4 b) { return a < b ? a : b; }
inline float4 max(float4 a, float4 b) { return a > b ? a : b; }
inline float4 splat4(float x) { return float4{x, x, x, x}; }

/// Four floats from memory of any alignment.
inline float4 load4(const float* p) {
    float4 result;
    __builtin_memcpy(&result, p, sizeof result);
    return result;
}
inline float4 load3(vec3 p) { return float4{p.x, p.y, p.z, 0.0f}; }

inline void store4(float* p, float4 v) { __builtin_memcpy(p, &v, sizeof v); }
/// Lane 3 of the first, the others of the second.
inline float4 replace_xyz(float4 w, float4 xyz) {
    const int4 keep = {0, 0, 0, -1};
    return std::bit_cast<float4>((std::bit_cast<int4>(w) & keep) |
                                 (std::bit_cast<int4>(xyz) & ~keep));
}

/// A box whose planes of an axis are a lane; what lane 3 holds is the user's business.
struct Box4 {
    float4 lower;
    float4 upper;

    static Box4 none() { return {splat4(kEmptyPlane), splat4(-kEmptyPlane)}; }

    void extend(float4 p) {
        lower = min(lower, p);
        upper = max(upper, p);
    }
    void extend(const Box4& b) {
        lower = min(lower, b.lower);
        upper = max(upper, b.upper);
    }
    /// What half_area multiplies; 0 for an empty box.
    float4 extent() const { return max(upper - lower, float4{}); }

    Box box() const { return {{lower[0], lower[1], lower[2]}, {upper[0], upper[1], upper[2]}}; }
};

}  // namespace morphray
