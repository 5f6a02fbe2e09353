// What the parts of the single-ray tracer answer for some rays.
#pragma once

#include <cstddef>
#include <cstdint>

#include "common/interop/bvh_layout.h"

namespace mray::cpu {

struct BoxAnswers {
    /// For each ray, by slots.
    std::uint32_t met[64];
    float t_enter[64][kWidth];
    /// All rays at once: the slots, and a bound of t_enter.
    std::uint32_t met_by_any;
    float least_enter[kWidth];
    /// For each slot, by rays.
    std::uint64_t met_by[kWidth];
};

struct LeafCounts {
    std::size_t hits = 0;
    std::size_t certain = 0;
    std::size_t differences = 0;
};

}  // namespace mray::cpu
