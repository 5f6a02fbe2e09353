#include "common/scene/exact_crossing.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cassert>
#include <cstddef>
#include <cstdint>

namespace mray {
namespace {

/// An integer in two's complement, the lowest word first. Its number of words is that of the whole
/// computation, in which nothing overflows.
class Integer {
public:
    // Coordinates have at most 24 binary digits at places of 2^-149 to 2^127, and their differences
    // a digit more: 278 in all. The determinant of nine of them has three times as many and 3.
    static constexpr std::size_t kMostWords = 27;
    static_assert(32 * kMostWords > 3 * 278 + 3);

    explicit Integer(std::size_t words) : size_(words) { assert(words <= kMostWords); }

    /// mantissa * 2^shift.
    static Integer shifted(std::size_t words, std::int32_t mantissa, std::uint32_t shift) {
        Integer n(words);
        const std::uint64_t size =
            std::uint64_t{static_cast<std::uint32_t>(mantissa < 0 ? -mantissa : mantissa)}
            << (shift % 32);
        const std::size_t at = shift / 32;
        n.words_[at] = static_cast<std::uint32_t>(size);
        if (at + 1 < words) n.words_[at + 1] = static_cast<std::uint32_t>(size >> 32);
        return mantissa < 0 ? Integer(words) - n : n;
    }

    friend Integer operator+(const Integer& a, const Integer& b) {
        Integer n(a.size_);
        std::uint64_t carry = 0;
        for (std::size_t i = 0; i < n.size_; ++i) {
            carry += std::uint64_t{a.words_[i]} + b.words_[i];
            n.words_[i] = static_cast<std::uint32_t>(carry);
            carry >>= 32;
        }
        return n;
    }
    friend Integer operator-(const Integer& a, const Integer& b) {
        Integer n(a.size_);
        std::uint64_t carry = 1;
        for (std::size_t i = 0; i < n.size_; ++i) {
            carry += std::uint64_t{a.words_[i]} + static_cast<std::uint32_t>(~b.words_[i]);
            n.words_[i] = static_cast<std::uint32_t>(carry);
            carry >>= 32;
        }
        return n;
    }
    /// Modulo 2^(32 words), which is the product where that fits.
    friend Integer operator*(const Integer& a, const Integer& b) {
        Integer n(a.size_);
        for (std::size_t i = 0; i < n.size_; ++i) {
            if (a.words_[i] == 0) continue;
            std::uint64_t carry = 0;
            for (std::size_t k = 0; i + k < n.size_; ++k) {
                carry += std::uint64_t{a.words_[i]} * b.words_[k] + n.words_[i + k];
                n.words_[i + k] = static_cast<std::uint32_t>(carry);
                carry >>= 32;
            }
        }
        return n;
    }
    /// -1, 0 or 1.
    int sign() const {
        if ((words_[size_ - 1] >> 31) != 0) return -1;
        const auto end = words_.begin() + static_cast<std::ptrdiff_t>(size_);
        return std::any_of(words_.begin(), end, [](std::uint32_t word) { return word != 0; });
    }

private:
    std::array<std::uint32_t, kMostWords> words_ = {};
    std::size_t size_;
};

/// A finite float as mantissa * 2^exponent; the exponent of 0 is that of the least float.
struct FloatParts {
    std::int32_t mantissa;
    int exponent;

    explicit FloatParts(float x) {
        const std::uint32_t bits = std::bit_cast<std::uint32_t>(x);
        const std::uint32_t field = (bits >> 23) & 255;
        const std::uint32_t digits = (bits & 0x7FFFFF) | (field == 0 ? 0 : 0x800000);
        mantissa = static_cast<std::int32_t>(digits);
        if ((bits >> 31) != 0) mantissa = -mantissa;
        exponent = static_cast<int>(std::max(field, 1u)) - 150;
    }
};

/// The least and the largest exponent of numbers that are not 0.
struct Exponents {
    int least = 1000;
    int most = -1000;

    void add(vec3 p) {
        for (int axis = 0; axis < 3; ++axis) {
            const FloatParts parts(p[axis]);
            if (parts.mantissa == 0) continue;
            least = std::min(least, parts.exponent);
            most = std::max(most, parts.exponent);
        }
    }
    /// Words for a determinant of differences: see Integer::kMostWords.
    std::size_t words() const {
        const int digits = 3 * (std::max(most - least, 0) + 25) + 3;
        return static_cast<std::size_t>(digits) / 32 + 1;
    }
};

struct Vector {
    Integer x;
    Integer y;
    Integer z;
};

Vector cross(const Vector& a, const Vector& b) {
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

/// The vectors from a point to others, in units of the least binary digit of them all.
class Offsets {
public:
    Offsets(vec3 from, const Exponents& exponents)
        : exponents_(exponents), words_(exponents.words()), from_(integers(from)) {}

    Vector operator()(vec3 to) const {
        const Vector p = integers(to);
        return {p.x - from_.x, p.y - from_.y, p.z - from_.z};
    }

private:
    Vector integers(vec3 p) const { return {integer(p.x), integer(p.y), integer(p.z)}; }
    Integer integer(float x) const {
        const FloatParts parts(x);
        if (parts.mantissa == 0) return Integer(words_);
        return Integer::shifted(words_, parts.mantissa,
                                static_cast<std::uint32_t>(parts.exponent - exponents_.least));
    }

    Exponents exponents_;
    std::size_t words_;
    Vector from_;
};

/// The sign of the edge function of a and b, which is `sign`, for the moved point.
int moved_sign(int sign, vec3 a, vec3 b) {
    if (sign != 0) return sign;
    if (a.y != b.y) return a.y > b.y ? 1 : -1;
    if (a.x != b.x) return b.x > a.x ? 1 : -1;
    return 0;
}

bool any_opposite(const Integer& a, const Integer& b, const Integer& c) {
    const int signs[3] = {a.sign(), b.sign(), c.sign()};
    const auto [least, most] = std::minmax_element(std::begin(signs), std::end(signs));
    return *least < 0 && *most > 0;
}

bool is_in_box(vec3 p, vec3 a, vec3 b, vec3 c) {
    for (int axis = 0; axis < 3; ++axis) {
        if (p[axis] < std::min({a[axis], b[axis], c[axis]}) ||
            p[axis] > std::max({a[axis], b[axis], c[axis]}))
            return false;
    }
    return true;
}

}  // namespace

ExactCrossing exact_crossing(vec3 p, vec3 a, vec3 b, vec3 c) {
    Exponents exponents;
    for (const vec3& point : {p, a, b, c}) exponents.add(point);
    const Offsets from_p(p, exponents);
    const Vector ra = from_p(a);
    const Vector rb = from_p(b);
    const Vector rc = from_p(c);
    // Edge functions, opposite to a, b and c, in the planes of two axes.
    const Vector u = cross(rb, rc);
    const Vector v = cross(rc, ra);
    const Vector w = cross(ra, rb);
    int height = (u.z * ra.z + v.z * rb.z + w.z * rc.z).sign();
    ExactCrossing crossing;
    // In the plane of the triangle, and not outside of it in any of three projections. Where the
    // triangle has no area its corners are on a line, and so is p then.
    crossing.is_on_triangle = height == 0 && is_in_box(p, a, b, c) &&
                              !any_opposite(u.x, v.x, w.x) && !any_opposite(u.y, v.y, w.y) &&
                              !any_opposite(u.z, v.z, w.z);
    const int side = moved_sign(u.z.sign(), b, c);
    if (side == 0 || moved_sign(v.z.sign(), c, a) != side || moved_sign(w.z.sign(), a, b) != side)
        return crossing;
    // The move changes the height by -(normal . move), and the normal's z has the sign `side`.
    if (height == 0) height = -(u.x + v.x + w.x).sign();
    if (height == 0) height = -(u.y + v.y + w.y).sign();
    if (height == 0) height = -side;
    if (height == side) crossing.sign = side;
    return crossing;
}

}  // namespace mray
