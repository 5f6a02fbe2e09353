#include "scenes/polygons/triangulate.h"

#include <gmpxx.h>

#include <algorithm>
#include <cmath>
#include <compare>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

namespace mray {
namespace {

struct PlanePoint {
    double x = 0;
    double y = 0;
    auto operator<=>(const PlanePoint&) const = default;
};

/// 1 if c is left of the line from a to b, -1 right of it, 0 on it. Exact for coordinates that are
/// floats.
int side(PlanePoint a, PlanePoint b, PlanePoint c) {
    const double left = (b.x - a.x) * (c.y - a.y);
    const double right = (b.y - a.y) * (c.x - a.x);
    const double area = left - right;
    // Seven roundings of 2^-53 each: less than 2^-50. Products that are 0 are exact.
    if (left == 0 || right == 0 || std::abs(area) > 0x1p-50 * (std::abs(left) + std::abs(right)))
        return area > 0 ? 1 : area < 0 ? -1 : 0;
    const auto difference = [](double from, double to) -> mpz_class {
        return mpz_class(std::ldexp(to, 149)) - mpz_class(std::ldexp(from, 149));
    };
    return cmp(difference(a.x, b.x) * difference(a.y, c.y),
               difference(a.y, b.y) * difference(a.x, c.x));
}

// Ears of larger faces would take seconds.
constexpr std::size_t kMostCorners = 8192;
// A face that crosses itself more often has no triangles that anyone wants.
constexpr int kMostCrossings = 64;

/// Cuts triangles off a closed curve that does not cross itself, each of a corner and its
/// neighbours. Edges may lie on one another and corners coincide.
///
/// Based on: G. H. Meisters. Polygons have ears. 1975.
class EarCutter {
public:
    explicit EarCutter(std::span<const PlanePoint> points)
        : points_(points), next_(points.size()), previous_(points.size()) {
        const auto count = static_cast<std::uint32_t>(points.size());
        for (std::uint32_t i = 0; i < count; ++i)
            next_[previous_[(i + 1) % count] = i] = (i + 1) % count;
    }

    /// n - 2 triangles of n > 3 points. `crosses` is set where none is right, as where edges cross.
    std::vector<uvec3> cut(bool& crosses) {
        std::vector<uvec3> triangles;
        std::uint32_t corner = 0;
        int crossings = 0;
        for (std::size_t left = points_.size(); left > 2; --left) {
            const auto find = [&](auto is_cut) {
                for (std::size_t tried = 0; tried < left; ++tried, corner = next_[corner])
                    if (is_cut(corner)) return true;
                return false;
            };
            // Without a spike there is an ear, or a corner on the line of its neighbours.
            if (crossings < kMostCrossings && !find([&](std::uint32_t b) { return is_spike(b); }) &&
                !find([&](std::uint32_t b) { return is_ear(b); }) &&
                !find([&](std::uint32_t b) { return turn(previous_[b], b, next_[b]) == 0; }))
                ++crossings;
            const std::uint32_t a = previous_[corner];
            const std::uint32_t c = next_[corner];
            triangles.emplace_back(a, corner, c);
            next_[a] = c;
            previous_[c] = a;
            corner = c;
        }
        crosses = crossings > 0;
        return triangles;
    }

private:
    int turn(std::uint32_t a, std::uint32_t b, std::uint32_t c) const {
        return side(points_[a], points_[b], points_[c]);
    }
    bool is_spike(std::uint32_t corner) const {
        const PlanePoint& a = points_[previous_[corner]];
        const PlanePoint& b = points_[corner];
        const PlanePoint& c = points_[next_[corner]];
        return a == b || b == c || ((a < b) != (b < c) && side(a, b, c) == 0);
    }
    /// Whether the triangle of a corner is inside: it turns left, and no edge is in it.
    bool is_ear(std::uint32_t b) const {
        const std::uint32_t a = previous_[b];
        const std::uint32_t c = next_[b];
        if (turn(a, b, c) <= 0) return false;
        for (std::uint32_t from = c; from != a; from = next_[from]) {
            const std::uint32_t to = next_[from];
            const auto is_right_of = [&](std::uint32_t p, std::uint32_t q) {
                return turn(p, q, from) <= 0 && turn(p, q, to) <= 0;
            };
            if (is_right_of(a, b) || is_right_of(b, c) || is_right_of(c, a)) continue;
            const auto [low, high] =
                std::minmax({turn(from, to, a), turn(from, to, b), turn(from, to, c)});
            if (low < 0 && high > 0) return false;
        }
        return surrounds_middle(a, b, c);
    }
    /// Whether the curve surrounds the middle of a triangle: edges there and back may be outside.
    bool surrounds_middle(std::uint32_t a, std::uint32_t b, std::uint32_t c) const {
        const PlanePoint middle = {(points_[a].x + points_[b].x + points_[c].x) / 3,
                                   (points_[a].y + points_[b].y + points_[c].y) / 3};
        int turns = 0;
        std::uint32_t from = a;
        do {
            const std::uint32_t to = next_[from];
            const bool rises = points_[from].y <= middle.y;
            if (rises != (points_[to].y <= middle.y) &&
                rises == (side(points_[from], points_[to], middle) > 0))
                turns += rises ? 1 : -1;
            from = to;
        } while (from != a);
        return turns > 0;
    }

    std::span<const PlanePoint> points_;
    /// Of the corners that are left.
    std::vector<std::uint32_t> next_, previous_;
};

using Corners = std::span<const std::uint32_t>;

// Newell's (M. E. Newell et al. 1972), relative to the first corner for the sake of digits. For a
// sum of 0, as of a bow tie, that of the sizes tells in which plane the face has area.
glm::dvec3 face_normal(Corners corners, std::span<const vec3> positions) {
    const glm::dvec3 origin(positions[corners[0]]);
    glm::dvec3 sum(0.0);
    glm::dvec3 sizes(0.0);
    glm::dvec3 last(0.0);
    for (const std::uint32_t corner : corners) {
        const glm::dvec3 p = glm::dvec3(positions[corner]) - origin;
        sum += glm::cross(last, p);
        sizes += glm::abs(glm::cross(last, p));
        last = p;
    }
    return sum == glm::dvec3(0.0) ? sizes : sum;
}

// Projects along the axis in which the face is largest, which keeps coordinates exact, and makes it
// counter-clockwise. Returns false for no area or what is not finite.
bool project(Corners corners, std::span<const vec3> positions, std::vector<PlanePoint>& points) {
    const glm::dvec3 normal = face_normal(corners, positions);
    int dropped = 0;
    for (int axis = 1; axis < 3; ++axis)
        if (std::abs(normal[axis]) > std::abs(normal[dropped])) dropped = axis;
    if (normal[dropped] == 0) return false;
    int x = (dropped + 1) % 3;
    int y = (dropped + 2) % 3;
    if (normal[dropped] < 0) std::swap(x, y);
    points.clear();
    for (const std::uint32_t corner : corners) {
        const vec3 p = positions[corner];
        if (!std::isfinite(p.x) || !std::isfinite(p.y) || !std::isfinite(p.z)) return false;
        points.push_back({p[x], p[y]});
    }
    return true;
}

/// Whether the triangles of the first corner turn left, and not beyond where they began.
bool fan_covers(std::span<const PlanePoint> points) {
    bool is_past_half = false;
    for (std::size_t i = 1; i + 1 < points.size(); ++i) {
        const int turn = side(points[0], points[1], points[i + 1]);
        if (side(points[0], points[i], points[i + 1]) <= 0 || (is_past_half && turn >= 0))
            return false;
        is_past_half = is_past_half || turn < 0;
    }
    return true;
}

}  // namespace

std::vector<uvec3> triangulate(const Polygons& faces, std::span<const vec3> positions,
                               std::vector<uvec3>* corners_of_triangles,
                               std::vector<std::size_t>* crossing) {
    std::vector<uvec3> triangles;
    triangles.reserve(faces.corners.size() - 2 * faces.corner_counts.size());
    std::vector<PlanePoint> points;
    std::vector<uvec3> ears;
    std::uint32_t first = 0;
    std::size_t polygon = 0;
    for (std::size_t face = 0; face < faces.corner_counts.size(); ++face) {
        const std::uint32_t count = faces.corner_counts[face];
        const Corners corners(faces.corners.data() + first, count);
        const auto add = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
            triangles.emplace_back(corners[a], corners[b], corners[c]);
            if (corners_of_triangles != nullptr)
                corners_of_triangles->emplace_back(first + a, first + b, first + c);
        };
        const bool is_fan =
            count == 3 || !project(corners, positions, points) || fan_covers(points);
        ears.clear();
        bool crosses = false;
        if (!is_fan && count > kMostCorners)
            crosses = true;
        else if (!is_fan)
            ears = EarCutter(points).cut(crosses);
        for (std::uint32_t i = 1; ears.empty() && i + 1 < count; ++i) add(0, i, i + 1);
        for (const uvec3& ear : ears) add(ear.x, ear.y, ear.z);
        if (crosses && crossing != nullptr) crossing->push_back(polygon);
        if (count > 3) ++polygon;
        first += count;
    }
    return triangles;
}

}  // namespace mray
