#include "scenes/gltf/file/view_filters.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

namespace mray::gltf {
namespace {

/// Rounds to the nearest whole number, away from 0 from the middle; 0 for NaN.
template <class T>
T rounded(double value) {
    constexpr double kMost = std::numeric_limits<T>::max();
    if (!(std::fabs(value) <= kMost)) return value > 0 ? std::numeric_limits<T>::max() : T{0};
    return static_cast<T>(value < 0 ? value - 0.5 : value + 0.5);
}

/// A point of the octahedron |x| + |y| + |z| = 1, unfolded to a square, to a unit vector. The third
/// component is what stands for 1.
template <class T>
void decode_octahedral(T* v) {
    constexpr double kOne = std::numeric_limits<T>::max();
    const double one = v[2];
    double x = v[0] / one;
    double y = v[1] / one;
    const double z = 1 - std::fabs(x) - std::fabs(y);
    const double folded = std::min(z, 0.0);
    x += x < 0 ? -folded : folded;
    y += y < 0 ? -folded : folded;
    const double scale = kOne / std::sqrt(x * x + y * y + z * z);
    v[0] = rounded<T>(x * scale);
    v[1] = rounded<T>(y * scale);
    v[2] = rounded<T>(z * scale);
}

/// Three components of a unit quaternion, in units in which the square root of 1/2 is `one`, and
/// the place of the fourth, the largest: the last two bits beside `one`.
void decode_quaternion(std::int16_t* q) {
    constexpr double kOne = 32767;
    const double one = q[3] | 3;
    const auto largest = static_cast<std::size_t>(q[3] & 3);
    const double scale = std::sqrt(0.5) / one;
    double square = 1;
    double others[3];
    for (std::size_t k = 0; k < 3; ++k) {
        others[k] = q[k] * scale;
        square -= others[k] * others[k];
    }
    for (std::size_t k = 0; k < 3; ++k)
        q[(largest + 1 + k) % 4] = rounded<std::int16_t>(others[k] * kOne);
    q[largest] = rounded<std::int16_t>(std::sqrt(std::max(square, 0.0)) * kOne);
}

/// 8 bits of exponent above 24 bits of a whole number, both with a sign.
float exponential(std::uint32_t bits) {
    const auto word = static_cast<std::int32_t>(bits);
    const std::int32_t exponent = word >> 24;
    const std::int32_t mantissa = static_cast<std::int32_t>(bits << 8) >> 8;
    return static_cast<float>(std::ldexp(static_cast<double>(mantissa), exponent));
}

/// Calls decode(elements) for each group of `count` numbers.
template <class T, class Decode>
void for_each(std::string& bytes, std::size_t count, const Decode& decode) {
    T numbers[4];
    for (std::size_t at = 0; at + count * sizeof(T) <= bytes.size(); at += count * sizeof(T)) {
        std::memcpy(numbers, bytes.data() + at, count * sizeof(T));
        decode(numbers);
        std::memcpy(bytes.data() + at, numbers, count * sizeof(T));
    }
}

}  // namespace

bool fits_filter(ViewFilter filter, std::uint64_t stride) {
    switch (filter) {
        case ViewFilter::kOctahedral:
            return stride == 4 || stride == 8;
        case ViewFilter::kQuaternion:
            return stride == 8;
        default:
            return true;
    }
}

void apply_filter(ViewFilter filter, std::size_t stride, std::string& bytes) {
    switch (filter) {
        case ViewFilter::kNone:
            return;
        case ViewFilter::kOctahedral:
            if (stride == 4) return for_each<std::int8_t>(bytes, 4, decode_octahedral<std::int8_t>);
            return for_each<std::int16_t>(bytes, 4, decode_octahedral<std::int16_t>);
        case ViewFilter::kQuaternion:
            return for_each<std::int16_t>(bytes, 4, decode_quaternion);
        case ViewFilter::kExponential:
            return for_each<std::uint32_t>(bytes, 1, [](std::uint32_t* word) {
                const float value = exponential(*word);
                std::memcpy(word, &value, sizeof value);
            });
    }
}

}  // namespace mray::gltf
