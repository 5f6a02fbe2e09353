// The instruction sets that SIMD code is compiled for: values that a process uses side by side.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace mray {

struct SimdTarget {
    /// "avx512", "avx2", "ssse3", "neon" or "scalar"; a static string.
    const char* name;
    /// Highway's bit of the target.
    std::int64_t bit;

    bool operator==(const SimdTarget& other) const { return bit == other.bit; }
};

/// The targets that are compiled in and run here, best first; "scalar" is always the last. Takes
/// tens of microseconds in a virtual machine: not to be called for each batch.
std::vector<SimdTarget> supported_simd_targets();

std::string names_of(const std::vector<SimdTarget>& targets);

/// The target of that name, or the best one for "" and "best". Throws Error: kBadArgument for a
/// name that is unknown, kUnavailable for one that is not compiled in or that this machine lacks.
SimdTarget find_simd_target(std::string_view name);

/// The name that stands for portable C++ without a target.
inline constexpr std::string_view kSimdOff = "off";

/// Throws Error as find_simd_target() does for a name that is neither kSimdOff nor one of a target.
void check_simd(std::string_view name);

/// The first of supported_simd_targets(), which the first call finds.
const SimdTarget& best_simd_target();

}  // namespace mray
