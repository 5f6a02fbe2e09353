#include "common/bvh/triangle_distance.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

namespace mray {
namespace {

double dot(const dvec3& a, const dvec3& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
double length(const dvec3& a) { return std::sqrt(dot(a, a)); }

/// A bound of the error of a corner's weight: `size` is its distance from the line through the
/// others, and `far` at least that of the point from any corner.
double weight_error(double far, double size) { return kDistanceRounding * far / size; }

/// The place inside the triangle, if p is over the inside; sets `is_certain` by whether that is
/// known. Weights are found along the longest edge and across it, as in triangle_distance2().
bool is_inside(const dvec3& p, const std::array<dvec3, 3>& x, DoublePlace& inside) {
    int first = 0;
    double longest2 = -1;
    for (int i = 0; i < 3; ++i) {
        const dvec3 edge = x[(i + 1) % 3] - x[i];
        const double length2 = dot(edge, edge);
        if (length2 > longest2) {
            longest2 = length2;
            first = i;
        }
    }
    const int second = (first + 1) % 3;
    const int third = (first + 2) % 3;
    const dvec3 e = x[second] - x[first];
    const dvec3 f = x[third] - x[first];
    const dvec3 t = p - x[first];
    const double r_along = dot(f, e) / longest2;
    const dvec3 height = f - e * r_along;
    const double height2 = dot(height, height);
    const double along = dot(t, e) / longest2;
    const double of_r = dot(t - e * along, height) / height2;
    const double of_q = along - of_r * r_along;
    const double of_p = 1 - of_q - of_r;
    const double far = length(t) + std::sqrt(longest2) * (1 + std::abs(of_r));
    const double error = weight_error(far, std::sqrt(height2));
    const double least = std::min({of_p, of_q, of_r});
    // False for numbers that are not finite.
    inside.is_certain = std::abs(least) > error;
    inside.place.weights[static_cast<std::size_t>(first)] = of_p;
    inside.place.weights[static_cast<std::size_t>(second)] = of_q;
    inside.place.weights[static_cast<std::size_t>(third)] = of_r;
    inside.place.point = x[first] + e * of_q + f * of_r;
    return inside.is_certain && least > 0;
}

DoublePlace place_on_edge(const dvec3& p, const std::array<dvec3, 3>& x, int i) {
    const int j = (i + 1) % 3;
    const dvec3 e = x[j] - x[i];
    const dvec3 t = p - x[i];
    const double length2 = dot(e, e);
    const double at = length2 > 0 ? dot(t, e) / length2 : 0;
    const double size = std::sqrt(length2);
    const double s = std::clamp(at, 0.0, 1.0);
    DoublePlace on_edge;
    on_edge.is_certain =
        std::min(std::abs(at), std::abs(1 - at)) > weight_error(length(t) + size, size);
    on_edge.place.weights = {};
    on_edge.place.weights[static_cast<std::size_t>(i)] = 1 - s;
    on_edge.place.weights[static_cast<std::size_t>(j)] = s;
    on_edge.place.point = s == 1 ? x[j] : x[i] + e * s;
    return on_edge;
}

/// A vector in units of a power of two in which all coordinates are whole.
struct WholeVector {
    mpz_class x;
    mpz_class y;
    mpz_class z;
};

WholeVector operator-(const WholeVector& a, const WholeVector& b) {
    return {a.x - b.x, a.y - b.y, a.z - b.z};
}
mpz_class dot(const WholeVector& a, const WholeVector& b) {
    return a.x * b.x + a.y * b.y + a.z * b.z;
}
WholeVector cross(const WholeVector& a, const WholeVector& b) {
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

/// Makes numbers whole that are multiples of 2^-digits.
class Unit {
public:
    Unit(const dvec3& p, const Corners& corners) {
        extend(p);
        for (const vec3& corner : corners) extend(corner);
    }

    WholeVector operator()(const dvec3& v) const { return {whole(v.x), whole(v.y), whole(v.z)}; }
    /// The square of a length in this unit, in squares of 1.
    mpq_class square(mpq_class length2) const {
        mpq_div_2exp(length2.get_mpq_t(), length2.get_mpq_t(), 2 * digits_);
        return length2;
    }

private:
    void extend(const dvec3& v) {
        for (int axis = 0; axis < 3; ++axis) {
            if (v[axis] == 0) continue;
            const int digits = 52 - std::ilogb(v[axis]);
            digits_ = std::max(digits_, static_cast<mp_bitcnt_t>(std::max(digits, 0)));
        }
    }
    mpz_class whole(double x) const {
        int exponent = 0;
        mpz_class z(std::ldexp(std::frexp(x, &exponent), 53));
        const int shift = exponent - 53 + static_cast<int>(digits_);
        mpz_mul_2exp(z.get_mpz_t(), z.get_mpz_t(), static_cast<mp_bitcnt_t>(std::max(shift, 0)));
        return z;
    }

    mp_bitcnt_t digits_ = 0;
};

}  // namespace

double blur_of(const Corners& corners) {
    double largest = 0;
    for (const vec3& corner : corners)
        for (int axis = 0; axis < 3; ++axis)
            largest = std::max(largest, static_cast<double>(std::abs(corner[axis])));
    return kDistanceRounding * largest;
}

Feature feature_of(const Corners& corners, const std::array<double, 3>& weights) {
    Feature feature = {};
    std::size_t first = 0;
    while (weights[first] == 0) ++first;
    for (std::size_t i = 0; i < 3; ++i) {
        const vec3& corner = corners[weights[i] != 0 ? i : first];
        feature[i] = {corner.x, corner.y, corner.z};
    }
    std::sort(feature.begin(), feature.end());
    // Two of a vertex or three: one thing.
    if (feature[0] == feature[1]) feature[1] = feature[2];
    return feature;
}

DoublePlace place_in_doubles(const dvec3& p, const dvec3& r, const Corners& corners) {
    const std::array<dvec3, 3> x = {dvec3(corners[0]), dvec3(corners[1]), dvec3(corners[2])};
    DoublePlace inside;
    if (is_inside(p, x, inside)) return inside;
    const double blur = blur_of(corners);
    DoublePlace edges[3];
    Difference distances[3];
    int nearest = 0;
    for (int i = 0; i < 3; ++i) {
        edges[i] = place_on_edge(p, x, i);
        distances[i] = difference(p, r, edges[i].place.point, blur);
        if (distances[i].value < distances[nearest].value) nearest = i;
    }
    bool is_certain = inside.is_certain;
    for (int i = 0; i < 3; ++i) {
        if (distances[i].least() > distances[nearest].most()) continue;
        is_certain &= edges[i].is_certain &&
                      (i == nearest || feature_of(corners, edges[i].place.weights) ==
                                           feature_of(corners, edges[nearest].place.weights));
    }
    edges[nearest].is_certain = is_certain;
    return edges[nearest];
}

double distance_in_doubles(const dvec3& p, const Corners& corners,
                           const std::array<double, 3>& weights) {
    // Differences are relative to a corner of the place, so errors are parts of the way from there.
    std::array<dvec3, 3> x;
    std::size_t count = 0;
    for (std::size_t i = 0; i < 3; ++i)
        if (weights[i] != 0) x[count++] = dvec3(corners[i]);
    const dvec3 t = p - x[0];
    if (count == 1) return length(t);
    const dvec3 e = x[1] - x[0];
    const dvec3 f = count == 2 ? t : x[2] - x[0];
    const dvec3 normal = glm::cross(e, f);
    const double normal2 = dot(normal, normal);
    const double product2 = dot(e, e) * dot(f, f);
    // The cross product is off by at most kDistanceRounding |e| |f|.
    if (count == 2) return product2 <= 0x1p+50 * normal2 ? std::sqrt(normal2 / dot(e, e)) : 0;
    // Seven roundings of the six products of a determinant (J. R. Shewchuk. Adaptive Precision
    // Floating-Point Arithmetic and Fast Robust Geometric Predicates. DCG 18(3), 1997).
    const dvec3 a = glm::abs(e), b = glm::abs(f);
    const dvec3 sizes(a.y * b.z + a.z * b.y, a.z * b.x + a.x * b.z, a.x * b.y + a.y * b.x);
    const double height = std::abs(dot(normal, t));
    const bool is_certain = 0x1p-50 * dot(sizes, glm::abs(t)) <= 0x1p-24 * height;
    return is_certain && product2 <= 0x1p+40 * normal2 ? height / std::sqrt(normal2) : 0;
}

ExactDistance exact_distance(const dvec3& p, const Corners& corners) {
    const Unit unit(p, corners);
    const WholeVector q = unit(p);
    const WholeVector x[3] = {unit(corners[0]), unit(corners[1]), unit(corners[2])};
    const WholeVector t[3] = {q - x[0], q - x[1], q - x[2]};
    const WholeVector normal = cross(x[1] - x[0], x[2] - x[0]);
    ExactDistance inside;
    bool is_inside = true;
    for (std::size_t i = 0; i < 3; ++i) {
        inside.weights[i] = dot(normal, cross(t[(i + 1) % 3], t[(i + 2) % 3]));
        is_inside &= inside.weights[i] > 0;
    }
    if (is_inside) {
        const mpz_class height = dot(normal, t[0]);
        inside.distance2 = unit.square(mpq_class(height * height, dot(normal, normal)));
        inside.distance2.canonicalize();
        return inside;
    }
    ExactDistance nearest;
    for (std::size_t i = 0; i < 3; ++i) {
        const std::size_t j = (i + 1) % 3;
        const WholeVector e = x[j] - x[i];
        const mpz_class length2 = dot(e, e);
        const mpz_class along = dot(t[i], e);
        ExactDistance edge;
        if (along <= 0) {
            edge.weights[i] = 1;
            edge.distance2 = dot(t[i], t[i]);
        } else if (along >= length2) {
            edge.weights[j] = 1;
            edge.distance2 = dot(t[j], t[j]);
        } else {
            edge.weights[i] = length2 - along;
            edge.weights[j] = along;
            edge.distance2 = mpq_class(dot(t[i], t[i]) * length2 - along * along, length2);
            edge.distance2.canonicalize();
        }
        edge.distance2 = unit.square(edge.distance2);
        if (i == 0 || edge.distance2 < nearest.distance2) nearest = edge;
    }
    return nearest;
}

}  // namespace mray
