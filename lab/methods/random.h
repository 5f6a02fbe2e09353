// Numbers of a fixed sequence.
#pragma once

#include <glm/vec3.hpp>
#include <random>

namespace mray::lab {

class Random {
public:
    explicit Random(std::uint64_t seed) : bits_(seed) {}

    std::size_t below(std::size_t count) { return bits_() % count; }
    double real(double lower, double upper) {
        return lower + (upper - lower) * static_cast<double>(bits_() >> 11) * 0x1p-53;
    }
    /// In [-reach, reach) on each axis.
    glm::dvec3 point(double reach) {
        return glm::dvec3{real(-reach, reach), real(-reach, reach), real(-reach, reach)};
    }

private:
    std::mt19937_64 bits_;
};

}  // namespace mray::lab
