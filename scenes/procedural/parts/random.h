// Pseudorandom numbers as pure functions of a seed and an index.
#pragma once

#include <cstdint>

#include <glm/vec3.hpp>

#include "scenes/trig.h"

namespace mray {

/// Based on: Guy L. Steele Jr., Doug Lea, Christine H. Flood. Fast splittable pseudorandom number
/// generators. OOPSLA 2014: the finaliser of SplitMix64, here on a counter.
inline std::uint64_t hash_bits(std::uint64_t seed, std::uint64_t index) {
    std::uint64_t z = (seed << 40) + (index + 1) * 0x9E3779B97F4A7C15u;
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9u;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBu;
    return z ^ (z >> 31);
}

/// The k-th draw for an index: uniform in [0, 1).
inline double uniform(std::uint64_t seed, std::uint64_t index, std::uint64_t k = 0) {
    return static_cast<double>(hash_bits(seed + k, index) >> 11) * 0x1p-53;
}

/// A direction, uniform on the unit sphere, from draws k and k + 1.
inline glm::dvec3 uniform_direction(std::uint64_t seed, std::uint64_t index, std::uint64_t k = 0) {
    const double y = 2 * uniform(seed, index, k) - 1;
    const double around = uniform(seed, index, k + 1);
    const double ring = std::sqrt(1 - y * y);
    return {ring * cos_turns(around), y, ring * sin_turns(around)};
}

}  // namespace mray
