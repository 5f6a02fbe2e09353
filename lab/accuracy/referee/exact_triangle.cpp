// Intersects one ray with one triangle in exact arithmetic over their floats.
#include <gmpxx.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

#include "lab/accuracy/referee/exact_referee.h"

namespace mray::accuracy {
namespace {

// A determinant of three rounded differences, its products and its sums: 8 roundings of at most
// 2^-53 of the sum of the products' magnitudes, and again as much for their products.
constexpr double kDeterminantError = 0x1p-49;

// Relative errors up to which t is taken from doubles: a small part of a float's ulp.
constexpr double kPreciseT = 0x1p-28;

constexpr std::size_t kSum = 3;
constexpr std::size_t kVolume = 4;

struct Determinant {
    double value;
    double error;
};

/// p . (q x r).
Determinant determinant(const dvec3& p, const dvec3& q, const dvec3& r) {
    double value = 0;
    double magnitude = 0;
    for (int i = 0; i < 3; ++i) {
        const int j = (i + 1) % 3;
        const int k = (i + 2) % 3;
        const double left = q[j] * r[k];
        const double right = q[k] * r[j];
        value += p[i] * (left - right);
        magnitude += std::abs(p[i]) * (std::abs(left) + std::abs(right));
    }
    return {value, kDeterminantError * magnitude};
}

int sign_of(double x) { return (x > 0) - (x < 0); }

/// The sign of a value that is off by at most `error`; that of exact() where this does not decide.
template <class Exact>
int decide(double value, double error, const Exact& exact) {
    return std::abs(value) > error ? sign_of(value) : exact();
}

/// Every float multiplied by this is an integer.
constexpr int kIntegerExponent = 149;
mpz_class to_integer(float x) {
    return mpz_class(std::ldexp(static_cast<double>(x), kIntegerExponent));
}

}  // namespace

/// u, v, w, sum, volume, times 2^(3 * 149).
struct ExactTriangle::Integers {
    std::array<mpz_class, 5> value;
};

ExactTriangle::ExactTriangle(const Ray& ray, vec3 a, vec3 b, vec3 c)
    : ray_(ray), corners_{a, b, c} {
    for (std::size_t i = 0; i < 3; ++i) relative_[i] = dvec3(corners_[i]) - dvec3(ray.org);
    const dvec3 dir(ray.dir);
    value_[kSum] = error_[kSum] = 0;
    for (std::size_t edge = 0; edge < 3; ++edge) {
        const Determinant d =
            determinant(dir, relative_[(edge + 1) % 3], relative_[(edge + 2) % 3]);
        value_[edge] = d.value;
        error_[edge] = d.error;
        value_[kSum] += d.value;
        // Two more roundings, of less than twice the error's own reserve.
        error_[kSum] += 2 * d.error;
    }
    const Determinant volume = determinant(relative_[0], relative_[1], relative_[2]);
    value_[kVolume] = volume.value;
    error_[kVolume] = volume.error;
}

const ExactTriangle::Integers& ExactTriangle::integers() const {
    if (integers_ != nullptr) return *integers_;
    using Vector = std::array<mpz_class, 3>;
    const auto vector = [](vec3 v) {
        return Vector{to_integer(v.x), to_integer(v.y), to_integer(v.z)};
    };
    const Vector org = vector(ray_.org);
    const Vector dir = vector(ray_.dir);
    std::array<Vector, 3> p;
    for (std::size_t i = 0; i < 3; ++i) {
        p[i] = vector(corners_[i]);
        for (std::size_t axis = 0; axis < 3; ++axis) p[i][axis] -= org[axis];
    }
    const auto exact = [](const Vector& a, const Vector& b, const Vector& c) {
        return mpz_class(a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) +
                         a[2] * (b[0] * c[1] - b[1] * c[0]));
    };
    const auto made = std::make_shared<Integers>();
    for (std::size_t edge = 0; edge < 3; ++edge) {
        made->value[edge] = exact(dir, p[(edge + 1) % 3], p[(edge + 2) % 3]);
    }
    made->value[kSum] = made->value[0] + made->value[1] + made->value[2];
    made->value[kVolume] = exact(p[0], p[1], p[2]);
    integers_ = made;
    return *integers_;
}

int ExactTriangle::sign(std::size_t i) const {
    // No error: every product has a factor 0, and a rounded difference of 0 is exact.
    if (error_[i] == 0) return 0;
    return decide(value_[i], error_[i], [&] { return sgn(integers().value[i]); });
}

bool ExactTriangle::is_met() const {
    bool negative = false;
    bool positive = false;
    // Decide in double first, which suffices for most triangles.
    for (std::size_t i = 0; i < 3; ++i) {
        negative |= value_[i] < -error_[i];
        positive |= value_[i] > error_[i];
    }
    if (negative && positive) return false;
    for (std::size_t i = 0; i < 3; ++i) {
        negative |= sign(i) < 0;
        positive |= sign(i) > 0;
    }
    return negative != positive;
}

bool ExactTriangle::has_t() const { return sign(kSum) != 0; }

double ExactTriangle::t() const {
    if (std::abs(value_[kSum]) * kPreciseT > error_[kSum] &&
        std::abs(value_[kVolume]) * kPreciseT > error_[kVolume]) {
        return value_[kVolume] / value_[kSum];
    }
    const Integers& exact = integers();
    return exact.value[kVolume].get_d() / exact.value[kSum].get_d();
}

int ExactTriangle::compare_t(const ExactTriangle& other) const {
    const double left = value_[kVolume] * other.value_[kSum];
    const double right = other.value_[kVolume] * value_[kSum];
    const double bound =
        2 * (error_[kVolume] * std::abs(other.value_[kSum]) +
             other.error_[kSum] * std::abs(value_[kVolume]) +
             other.error_[kVolume] * std::abs(value_[kSum]) +
             error_[kSum] * std::abs(other.value_[kVolume]) + error_[kVolume] * other.error_[kSum] +
             other.error_[kVolume] * error_[kSum]) +
        0x1p-50 * (std::abs(left) + std::abs(right));
    return sign(kSum) * other.sign(kSum) * decide(left - right, bound, [&] {
               const Integers& ours = integers();
               const Integers& theirs = other.integers();
               return cmp(mpz_class(ours.value[kVolume] * theirs.value[kSum]),
                          mpz_class(theirs.value[kVolume] * ours.value[kSum]));
           });
}

int ExactTriangle::compare_t(float limit) const {
    const double bound = 2 * (error_[kVolume] + error_[kSum] * std::abs(limit)) +
                         0x1p-50 * std::abs(value_[kVolume]);
    return sign(kSum) * decide(value_[kVolume] - limit * value_[kSum], bound, [&] {
               const Integers& exact = integers();
               return cmp(mpz_class(exact.value[kVolume] << kIntegerExponent),
                          mpz_class(exact.value[kSum] * to_integer(limit)));
           });
}

bool ExactTriangle::in_range() const {
    return compare_t(0.0f) > 0 && compare_t(ray_.tnear) >= 0 && compare_t(ray_.tfar) <= 0;
}

double ExactTriangle::edge_distance() const {
    const dvec3 dir(ray_.dir);
    std::array<dvec3, 3> across;  // the corners, seen along the line
    for (std::size_t i = 0; i < 3; ++i)
        across[i] = relative_[i] - glm::dot(relative_[i], dir) / glm::dot(dir, dir) * dir;
    double least = INFINITY;
    for (std::size_t i = 0; i < 3; ++i) {
        const dvec3& from = across[i];
        const dvec3 way = across[(i + 1) % 3] - from;
        const double length2 = glm::dot(way, way);
        const double part = length2 > 0 ? std::clamp(-glm::dot(from, way) / length2, 0.0, 1.0) : 0;
        least = std::min(least, glm::length(from + part * way));
    }
    return least / size();
}

double ExactTriangle::size() const {
    const dvec3 dir(ray_.dir);
    double largest = 0;
    for (const dvec3& p : relative_) largest = std::max(largest, glm::length(glm::cross(p, dir)));
    return largest / glm::length(dir);
}

}  // namespace mray::accuracy
