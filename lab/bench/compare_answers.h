// Compares the answers of tracers whose arithmetic differs.
#pragma once

#include <cstdint>
#include <span>

#include "lab/bench/trace_work.h"

namespace mray::bench {

/// Counts of rays with different answers, by the first difference.
struct Mismatches {
    std::uint64_t hit = 0;      // hit or miss; occluded or not
    std::uint64_t prim_id = 0;  // mostly ties at shared edges
    std::uint64_t t = 0;        // by more than kMaxRelativeT

    std::uint64_t total() const { return hit + prim_id + t; }
};

/// Both tracers compute in float, where the error of t is some ulp of the distance of the ray's
/// origin; larger differences indicate an error.
inline constexpr float kMaxRelativeT = 1e-4f;

/// Compares the active rays of a work.
Mismatches compare_answers(const TraceWork& work, const TraceAnswers& a, const TraceAnswers& b);
Mismatches compare_hits(const TraceWork& work, std::span<const Hit> a, std::span<const Hit> b);

}  // namespace mray::bench
