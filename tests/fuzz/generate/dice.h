// Random draws of the generator, a pure function of the seed.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

#include "tests/support/test_scene.h"

namespace mray::fuzz {

using glm::dvec3;

/// Draw into variables or in braces, never in the arguments of one call, whose order of evaluation
/// depends on the compiler.
class Dice {
public:
    explicit Dice(std::uint64_t seed) : random_(seed) {}

    std::uint64_t bits() { return random_.bits(); }
    /// In [0, end).
    std::uint32_t below(std::uint32_t end) { return random_.below(end); }
    /// In [first, last].
    int from(int first, int last) {
        return first + static_cast<int>(below(static_cast<std::uint32_t>(last - first + 1)));
    }
    double real(double lower, double upper) { return random_.real(lower, upper); }
    bool one_in(std::uint32_t n) { return below(n) == 0; }
    double sign() { return one_in(2) ? 1 : -1; }

    /// Between two positive numbers, uniform in the logarithm.
    double magnitude(double lower, double upper) {
        return std::exp2(real(std::log2(lower), std::log2(upper)));
    }
    /// A point in [-extent, extent] on all axes.
    dvec3 point(double extent) {
        return dvec3{real(-extent, extent), real(-extent, extent), real(-extent, extent)};
    }
    /// Multiples of 1/8 in [-1, 1]: sums and halves of them are exact.
    dvec3 grid_point() { return dvec3{from(-8, 8), from(-8, 8), from(-8, 8)} / 8.0; }
    /// A direction of length 1.
    dvec3 direction() {
        for (;;) {
            const dvec3 d = point(1);
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

    template <class T, std::size_t N>
    const T& pick(const std::array<T, N>& choices) {
        return choices[below(static_cast<std::uint32_t>(N))];
    }

private:
    test::Random random_;
};

}  // namespace mray::fuzz
