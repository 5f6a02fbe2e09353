// A triangle as the builder sees it.
#pragma once

#include <bit>
#include <cstdint>

#include "common/simd/float4.h"

namespace morphray {

/// Its box, lower and -upper side by side for registers of eight, and, in lower's lane 3, its id,
/// made a float in [2, 2^33) so that no arithmetic on whole registers meets a denormal or a NaN.
/// minus_upper's lane 3 is 0.
struct PrimRef {
    float4 lower;
    float4 minus_upper;

    static constexpr std::uint32_t kIdBits = 0x40000000;

    PrimRef() = default;
    PrimRef(const Box4& box, std::uint32_t prim_id) : lower(box.lower), minus_upper(-box.upper) {
        lower[3] = std::bit_cast<float>(kIdBits | prim_id);
        minus_upper[3] = 0;
    }

    std::uint32_t prim_id() const { return std::bit_cast<std::uint32_t>(lower[3]) ^ kIdBits; }
    Box4 box() const { return {lower, -minus_upper}; }
    /// As Box4::none() is; read from memory as a number, which is a third of the instructions.
    bool empty() const {
        std::uint32_t first;
        __builtin_memcpy(&first, this, sizeof first);
        return first == std::bit_cast<std::uint32_t>(kEmptyPlane);
    }
    /// Twice the centroid of the box; 0 for an empty one. Exact order, no division.
    float4 centroid2() const { return lower - minus_upper; }
    float centroid2(int axis) const { return lower[axis] - minus_upper[axis]; }
};

}  // namespace morphray
