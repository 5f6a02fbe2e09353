// Vectors of whole numbers of any length, for exact arithmetic.
#pragma once

#include <gmpxx.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <glm/ext/vector_double3.hpp>

namespace mray {

struct WholeVector {
    mpz_class x, y, z;

    bool operator==(const WholeVector&) const = default;
    bool is_zero() const { return x == 0 && y == 0 && z == 0; }
};

inline WholeVector operator-(const WholeVector& a) { return {-a.x, -a.y, -a.z}; }
inline WholeVector operator-(const WholeVector& a, const WholeVector& b) {
    return {a.x - b.x, a.y - b.y, a.z - b.z};
}
inline mpz_class dot(const WholeVector& a, const WholeVector& b) {
    return a.x * b.x + a.y * b.y + a.z * b.z;
}
inline WholeVector cross(const WholeVector& a, const WholeVector& b) {
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

/// A power of two in whose units all coordinates of some finite points are whole.
class WholeUnit {
public:
    template <class... Points>
    explicit WholeUnit(const Points&... points) {
        (extend(glm::dvec3(points)), ...);
    }

    /// One of the points.
    WholeVector operator()(const glm::dvec3& p) const {
        return {whole(p.x), whole(p.y), whole(p.z)};
    }
    /// The square of a length in this unit, in squares of 1.
    mpq_class square(mpq_class length2) const {
        mpq_div_2exp(length2.get_mpq_t(), length2.get_mpq_t(), 2 * digits_);
        return length2;
    }

private:
    static constexpr int kMantissa = 53;

    void extend(const glm::dvec3& p) {
        for (int axis = 0; axis < 3; ++axis) {
            if (p[axis] == 0) continue;
            int exponent = 0;
            const double mantissa = std::ldexp(std::frexp(p[axis], &exponent), kMantissa);
            const auto bits = static_cast<std::uint64_t>(static_cast<std::int64_t>(mantissa));
            const int digits = kMantissa - exponent - std::countr_zero(bits);
            digits_ = std::max(digits_, static_cast<mp_bitcnt_t>(std::max(digits, 0)));
        }
    }
    mpz_class whole(double x) const {
        int exponent = 0;
        mpz_class z(std::ldexp(std::frexp(x, &exponent), kMantissa));
        const int shift = exponent - kMantissa + static_cast<int>(digits_);
        const auto places = static_cast<mp_bitcnt_t>(std::abs(shift));
        // The bits that are shifted out are 0.
        shift < 0 ? mpz_tdiv_q_2exp(z.get_mpz_t(), z.get_mpz_t(), places)
                  : mpz_mul_2exp(z.get_mpz_t(), z.get_mpz_t(), places);
        return z;
    }

    /// The unit is 2^-digits.
    mp_bitcnt_t digits_ = 0;
};

}  // namespace mray
