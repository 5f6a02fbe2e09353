#include "common/scene/triangle_crossing.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <span>
#include <tuple>
#include <vector>

#include "common/base/whole_vector.h"

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

using WholeTriangle = std::array<WholeVector, 3>;

WholeVector normal_of(const WholeTriangle& t) { return cross(t[1] - t[0], t[2] - t[0]); }

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
    const WholeVector normal = normal_of(t);
    if (!normal.is_zero()) {
        add_plane(normal, t[0]);
        for (std::size_t i = 0; i < 3; ++i)
            all.push_back({cross(normal, t[(i + 1) % 3] - t[i]), t[i]});
        return all;
    }
    // On a line, coordinates order points as they follow each other.
    const auto [p, q] = std::ranges::minmax(t, [](const WholeVector& a, const WholeVector& b) {
        return std::tie(a.x, a.y, a.z) < std::tie(b.x, b.y, b.z);
    });
    const WholeVector d = q - p;
    all.push_back({d, p});
    all.push_back({-d, q});
    // As dot(across, v) = 0 for all three, cross(d, v) = 0.
    const WholeTriangle across = {{{0, d.z, -d.y}, {-d.z, 0, d.x}, {d.y, -d.x, 0}}};
    const WholeTriangle axes = {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
    for (const WholeVector& plane : d.is_zero() ? axes : across) add_plane(plane, p);
    return all;
}

/// The ends of a part of a segment from p to q, by their weights of q.
using Section = std::optional<std::array<mpq_class, 2>>;

/// The part of a segment inside; nothing if there is none.
Section clipped(const WholeVector& p, const WholeVector& q, std::span<const HalfSpace> inside) {
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

/// Whether an edge of a has a point in b that is not in `shared`, a part of both. The corners of
/// what both triangles have in common lie on edges of one of them.
bool any_edge_crosses(const WholeTriangle& a, const WholeTriangle& b,
                      const std::optional<std::vector<HalfSpace>>& shared) {
    const std::vector<HalfSpace> inside = half_spaces(b);
    for (std::size_t i = 0; i < 3; ++i) {
        const WholeVector& p = a[i];
        const WholeVector& q = a[(i + 1) % 3];
        const Section section = clipped(p, q, inside);
        if (section && (!shared || section != clipped(p, q, *shared))) return true;
    }
    return false;
}

}  // namespace

bool triangles_cross(const Triangle& a, const Triangle& b) {
    if (are_apart(a, b)) return false;
    if (any_edge_surely_pierces(a, b) || any_edge_surely_pierces(b, a)) return true;
    const WholeUnit unit(a[0], a[1], a[2], b[0], b[1], b[2]);
    const WholeTriangle whole_a = {unit(a[0]), unit(a[1]), unit(a[2])};
    const WholeTriangle whole_b = {unit(b[0]), unit(b[1]), unit(b[2])};
    std::vector<WholeVector> corners;
    for (const WholeVector& corner : whole_a)
        if (std::ranges::count(whole_b, corner) > 0) corners.push_back(corner);
    // A vertex or an edge, as a triangle without area.
    std::optional<std::vector<HalfSpace>> shared;
    if (!corners.empty()) {
        corners.resize(3, corners.back());
        const WholeTriangle t = {corners[0], corners[1], corners[2]};
        if (!normal_of(t).is_zero()) return true;
        shared = half_spaces(t);
    }
    return any_edge_crosses(whole_a, whole_b, shared) || any_edge_crosses(whole_b, whole_a, shared);
}

}  // namespace mray
