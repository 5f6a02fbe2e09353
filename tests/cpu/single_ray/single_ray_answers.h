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
    /// For each slot, by rays.
    std::uint64_t met_by[kWidth];
    std::size_t used;
};

struct LeafCounts {
    std::size_t hits = 0;
    std::size_t differences = 0;
};

}  // namespace mray::cpu
