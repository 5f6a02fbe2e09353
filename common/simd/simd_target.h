// The instruction sets that the SIMD tracers are compiled for. They are values, so that one process
// can use several side by side; nothing here or in Highway's global state is switched.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace morphray {

struct SimdTarget {
    /// "avx512", "avx2", "sse4", "ssse3", "neon" or "scalar"; a static string.
    const char* name;
    /// Highway's number of it (common/simd/simd_dispatch-inl.h).
    std::int64_t bit;

    bool operator==(const SimdTarget& other) const { return bit == other.bit; }
};

/// Those that are compiled in and that this machine runs, best first; "scalar" is always the last.
/// Asks the processor, which takes tens of microseconds in a virtual machine: not for each batch.
std::vector<SimdTarget> supported_simd_targets();

/// "avx512, avx2, sse4": the names of these.
std::string names_of(const std::vector<SimdTarget>& targets);

/// The target of that name, or the best one for "" and "best". Throws Error: kBadArgument for a
/// name that is none, kUnavailable for one that is not compiled in or that this machine lacks.
SimdTarget find_simd_target(std::string_view name);

/// The best of supported_simd_targets(), asked for once.
const SimdTarget& best_simd_target();

}  // namespace morphray
