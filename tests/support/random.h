// Random numbers that are the same everywhere.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

#include "common/interop/arithmetic.h"

namespace mray::test {

using glm::dvec3;

/// SplitMix64 (G. Steele, D. Lea, C. Flood. Fast splittable pseudorandom number generators. 2014).
/// Draw into variables or in braces, never in the arguments of one call, whose order of evaluation
/// depends on the compiler.
class Random {
public:
    explicit Random(std::uint64_t seed) : state_(seed) {}

    std::uint64_t bits() {
        std::uint64_t z = (state_ += 0x9E3779B97F4A7C15u);
        z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9u;
        z = (z ^ (z >> 27)) * 0x94D049BB133111EBu;
        return z ^ (z >> 31);
    }
    std::uint32_t below(std::uint32_t end) { return static_cast<std::uint32_t>(bits() % end); }
    bool one_in(std::uint32_t n) { return below(n) == 0; }
    double sign() { return one_in(2) ? 1 : -1; }
    /// In [first, last].
    int from(int first, int last) {
        return first + static_cast<int>(below(static_cast<std::uint32_t>(last - first + 1)));
    }
    /// In [lower, upper).
    double real(double lower, double upper) {
        return lower + (upper - lower) * static_cast<double>(bits() >> 11) * 0x1p-53;
    }
    /// Between two positive numbers, uniform in the logarithm.
    double magnitude(double lower, double upper) {
        return std::exp2(real(std::log2(lower), std::log2(upper)));
    }

    /// A point in [-extent, extent] on all axes, in doubles and in floats.
    dvec3 exact_point(double extent) {
        return dvec3{real(-extent, extent), real(-extent, extent), real(-extent, extent)};
    }
    vec3 point(double extent = 1) { return vec3(exact_point(extent)); }
    /// Multiples of 1/8 in [-1, 1]: sums and halves of them are exact.
    dvec3 grid_point() { return dvec3{from(-8, 8), from(-8, 8), from(-8, 8)} / 8.0; }
    /// A direction of length 1.
    dvec3 direction() {
        for (;;) {
            const dvec3 d = exact_point(1);
            const double length = glm::length(d);
            if (length > 0.1 && length < 1) return d / length;
        }
    }
    dvec3 axis() {
        dvec3 d = {0, 0, 0};
        const int axis = from(0, 2);
        d[axis] = sign();
        return d;
    }

    template <class Range>
    auto& pick(Range&& choices) {
        return choices[below(static_cast<std::uint32_t>(std::size(choices)))];
    }

private:
    std::uint64_t state_;
};

}  // namespace mray::test
