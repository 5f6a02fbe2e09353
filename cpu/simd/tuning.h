// Limits between two ways to the same answers, by the lanes of a vector: measured, printed by the
// bench, and never found at start-up (lab/notes/cpu_tracer.md).
#pragma once

#include <cstdint>

namespace mray::cpu {

struct Tuning {
    std::uint32_t lanes;
    /// Camera packets test a leaf's triangles pixel by pixel for at most this many pixels a
    /// triangle.
    std::uint32_t small_triangle;
    /// Streams test the rays of a vector together if more than this many of them are at a leaf.
    std::uint32_t together_in_leaf;
};

inline constexpr Tuning kTunings[] = {{1, 8, 1}, {4, 8, 3}, {8, 8, 3}, {16, 4, 6}};

constexpr Tuning tuning_of(std::uint32_t lanes) {
    for (const Tuning& tuning : kTunings)
        if (tuning.lanes == lanes) return tuning;
    return kTunings[0];
}

}  // namespace mray::cpu
