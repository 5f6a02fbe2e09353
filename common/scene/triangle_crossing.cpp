#include "common/scene/triangle_crossing.h"

#include <gmpxx.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include <glm/ext/vector_double3.hpp>

namespace mray {
namespace {

using Triangle = std::array<vec3, 3>;

// ---- Doubles

/// The side of the plane of p, q and r that s is on: 1 or -1, or 0 if doubles cannot tell.
int certain_side(vec3 p, vec3 q, vec3 r, vec3 s) {
    const glm::dvec3 o(p);
    const glm::dvec3 a = glm::dvec3(q) - o;
    const glm::dvec3 b = glm::dvec3(r) - o;
    const glm::dvec3 c = glm::dvec3(s) - o;
    double value = 0, size = 0;
    for (int x = 0; x < 3; ++x) {
        const int y = (x + 1) % 3, z = (x + 2) % 3;
        value += c[x] * (a[y] * b[z] - a[z] * b[y]);
        size += std::abs(c[x]) * (std::abs(a[y] * b[z]) + std::abs(a[z] * b[y]));
    }
    if (!(std::abs(value) > kSideRounding * size)) return 0;
    return value > 0 ? 1 : -1;
}

/// Whether the inside of a segment surely goes through the inside of a triangle.
bool surely_pierces(vec3 p, vec3 q, const Triangle& t) {
    const int of_p = certain_side(t[0], t[1], t[2], p);
    if (of_p == 0 || certain_side(t[0], t[1], t[2], q) != -of_p) return false;
    const int turn = certain_side(p, q, t[0], t[1]);
    return turn != 0 && certain_side(p, q, t[1], t[2]) == turn &&
           certain_side(p, q, t[2], t[0]) == turn;
}

bool any_edge_surely_pierces(const Triangle& a, const Triangle& b) {
    return surely_pierces(a[0], a[1], b) || surely_pierces(a[1], a[2], b) ||
           surely_pierces(a[2], a[0], b);
}

bool are_apart(const Triangle& a, const Triangle& b) {
    for (int axis = 0; axis < 3; ++axis) {
        const auto [least_a, most_a] = std::minmax({a[0][axis], a[1][axis], a[2][axis]});
        const auto [least_b, most_b] = std::minmax({b[0][axis], b[1][axis], b[2][axis]});
        if (most_a < least_b || most_b < least_a) return true;
    }
    return false;
}

// ---- Integers

/// A vector in units of a power of two in which all coordinates of a pair are whole.
struct WholeVector {
    mpz_class x, y, z;

    bool operator==(const WholeVector&) const = default;
    bool is_zero() const { return x == 0 && y == 0 && z == 0; }
};

/// The power of two of the last digit that a coordinate of a pair may have.
int unit_exponent(const Triangle& a, const Triangle& b) {
    constexpr int kDigits = std::numeric_limits<float>::digits;
    int least = std::numeric_limits<float>::max_exponent;
    for (const Triangle* t : {&a, &b})
        for (const vec3& p : *t)
            for (int axis = 0; axis < 3; ++axis)
                if (p[axis] != 0) least = std::min(least, std::ilogb(p[axis]));
    return least - (kDigits - 1);
}

WholeVector operator-(const WholeVector& a, const WholeVector& b) {
    return {a.x - b.x, a.y - b.y, a.z - b.z};
}
WholeVector operator-(const WholeVector& a) { return {-a.x, -a.y, -a.z}; }
mpz_class dot(const WholeVector& a, const WholeVector& b) {
    return a.x * b.x + a.y * b.y + a.z * b.z;
}
WholeVector cross(const WholeVector& a, const WholeVector& b) {
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

using WholeTriangle = std::array<WholeVector, 3>;

WholeTriangle whole(const Triangle& t, int exponent) {
    WholeTriangle result;
    for (std::size_t i = 0; i < 3; ++i) {
        const auto of = [&](float x) {
            return mpz_class(std::ldexp(static_cast<double>(x), -exponent));
        };
        result[i] = {of(t[i].x), of(t[i].y), of(t[i].z)};
    }
    return result;
}

/// The points p with dot(normal, p - from) >= 0.
struct HalfSpace {
    WholeVector normal, from;
};

/// The half-spaces whose intersection is a triangle, a segment or a point.
std::vector<HalfSpace> half_spaces(const WholeTriangle& t) {
    std::vector<HalfSpace> all;
    const auto add_plane = [&](const WholeVector& normal, const WholeVector& from) {
        all.push_back({normal, from});
        all.push_back({-normal, from});
    };
    const WholeVector normal = cross(t[1] - t[0], t[2] - t[0]);
    if (!normal.is_zero()) {
        add_plane(normal, t[0]);
        for (std::size_t i = 0; i < 3; ++i)
            all.push_back({cross(normal, t[(i + 1) % 3] - t[i]), t[i]});
        return all;
    }
    // The longest of the edges has all corners.
    std::size_t first = 0;
    mpz_class longest = -1;
    for (std::size_t i = 0; i < 3; ++i) {
        const WholeVector edge = t[(i + 1) % 3] - t[i];
        if (const mpz_class length = dot(edge, edge); length > longest) {
            longest = length;
            first = i;
        }
    }
    const WholeVector& p = t[first];
    const WholeVector& q = t[(first + 1) % 3];
    const WholeVector d = q - p;
    if (d.is_zero()) {
        for (const WholeTriangle axes{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}}; const auto& axis : axes)
            add_plane(axis, p);
        return all;
    }
    // As dot(across, v) = 0 for all three, cross(d, v) = 0.
    const WholeTriangle all_across{{{0, d.z, -d.y}, {-d.z, 0, d.x}, {d.y, -d.x, 0}}};
    for (const WholeVector& across : all_across) add_plane(across, p);
    all.push_back({d, p});
    all.push_back({-d, q});
    return all;
}

/// The part of the segment from p to q inside, by its weights of q; nothing if there is none.
std::optional<std::array<mpq_class, 2>> clipped(const WholeVector& p, const WholeVector& q,
                                                std::span<const HalfSpace> inside) {
    std::array<mpq_class, 2> ends{0, 1};
    for (const auto& [normal, from] : inside) {
        const mpz_class at_p = dot(normal, p - from);
        const mpz_class at_q = dot(normal, q - from);
        if (at_p < 0 && at_q < 0) return std::nullopt;
        if (at_p >= 0 && at_q >= 0) continue;
        mpq_class place(at_p, mpz_class(at_p - at_q));
        place.canonicalize();
        if (at_p < 0) {
            ends[0] = std::max(ends[0], place);
        } else {
            ends[1] = std::min(ends[1], place);
        }
        if (ends[0] > ends[1]) return std::nullopt;
    }
    return ends;
}

/// What two triangles have in common by position: nothing, a vertex, an edge, or all corners.
struct SharedCorners {
    std::vector<WholeVector> corners;

    SharedCorners(const WholeTriangle& a, const WholeTriangle& b) {
        for (const WholeVector& corner : a)
            if (std::ranges::count(b, corner) > 0 && std::ranges::count(corners, corner) == 0)
                corners.push_back(corner);
    }
    bool is_triangle() const {
        return corners.size() == 3 &&
               !cross(corners[1] - corners[0], corners[2] - corners[0]).is_zero();
    }
    /// Whether p + weight * (q - p) is a vertex, or lies on an edge.
    bool has(const WholeVector& p, const WholeVector& q, const mpq_class& weight) const {
        const mpz_class& unit = weight.get_den();
        const mpz_class& part = weight.get_num();
        for (std::size_t i = 0; i < corners.size(); ++i) {
            const WholeVector& from = corners[i];
            const WholeVector edge = corners[(i + 1) % corners.size()] - from;
            const WholeVector at{unit * (p.x - from.x) + part * (q.x - p.x),
                                 unit * (p.y - from.y) + part * (q.y - p.y),
                                 unit * (p.z - from.z) + part * (q.z - p.z)};
            if (at.is_zero()) return true;
            const mpz_class along = dot(at, edge);
            if (cross(at, edge).is_zero() && along > 0 && along <= unit * dot(edge, edge))
                return true;
        }
        return false;
    }
};

/// Whether an edge of a has a point in b that is not shared. The corners of what both triangles
/// have in common lie on edges of one of them, and a shared edge has all of it if it has those.
bool any_edge_crosses(const WholeTriangle& a, const WholeTriangle& b, const SharedCorners& shared) {
    const std::vector<HalfSpace> inside = half_spaces(b);
    for (std::size_t i = 0; i < 3; ++i) {
        const WholeVector& p = a[i];
        const WholeVector& q = a[(i + 1) % 3];
        const auto ends = clipped(p, q, inside);
        if (ends && (!shared.has(p, q, (*ends)[0]) || !shared.has(p, q, (*ends)[1]))) return true;
    }
    return false;
}

}  // namespace

bool triangles_cross(const Triangle& a, const Triangle& b) {
    if (are_apart(a, b)) return false;
    if (any_edge_surely_pierces(a, b) || any_edge_surely_pierces(b, a)) return true;
    const int exponent = unit_exponent(a, b);
    const WholeTriangle whole_a = whole(a, exponent);
    const WholeTriangle whole_b = whole(b, exponent);
    const SharedCorners shared(whole_a, whole_b);
    return shared.is_triangle() || any_edge_crosses(whole_a, whole_b, shared) ||
           any_edge_crosses(whole_b, whole_a, shared);
}

}  // namespace mray
