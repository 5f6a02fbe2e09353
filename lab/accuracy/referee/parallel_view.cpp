// The triangles that lines parallel to a ray meet, within a given distance of the ray.
#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <numbers>
#include <tuple>

#include "lab/accuracy/referee/exact_referee.h"

namespace mray::accuracy {
namespace {

// The circle as a polygon inside it, at most 1 in 800 too small.
constexpr int kCircleCorners = 64;
// In radii of the circle. Corners are up to 2^21 radii away and doubles round them to 2^-31, so a
// gap that rounding leaves between two regions that meet is far narrower than this.
constexpr double kNarrow = 0x1p-16;

struct Place {
    double x, y;
};
using Polygon = std::vector<Place>;  // convex
using Corners = std::array<dvec3, 3>;

/// The half-plane where a x + b y + c is not negative.
struct Affine {
    double a, b, c;

    double at(const Place& p) const { return a * p.x + b * p.y + c; }
    Affine operator-() const { return {-a, -b, -c}; }
};

Polygon clipped(const Polygon& polygon, const Affine& half) {
    Polygon result;
    for (std::size_t i = 0; i < polygon.size(); ++i) {
        const Place& p = polygon[i];
        const Place& q = polygon[(i + 1) % polygon.size()];
        const double here = half.at(p);
        const double there = half.at(q);
        if (here >= 0) result.push_back(p);
        if ((here < 0) == (there < 0)) continue;
        const double part = here / (here - there);
        result.push_back({p.x + part * (q.x - p.x), p.y + part * (q.y - p.y)});
    }
    return result;
}

bool is_wide(const Polygon& polygon) {
    double area = 0;
    double around = 0;
    for (std::size_t i = 0; i < polygon.size(); ++i) {
        const Place& o = polygon.front();
        const Place& p = polygon[i];
        const Place& q = polygon[(i + 1) % polygon.size()];
        area += (p.x - o.x) * (q.y - o.y) - (p.y - o.y) * (q.x - o.x);
        around += std::hypot(q.x - p.x, q.y - p.y);
    }
    return area > kNarrow * around;
}

Polygon clipped(Polygon polygon, const std::vector<Affine>& region) {
    for (const Affine& half : region) polygon = clipped(polygon, half);
    return polygon;
}

/// Whether the whole polygon is outside one of the half-planes.
bool is_beyond(const Polygon& polygon, const std::vector<Affine>& region) {
    return std::any_of(region.begin(), region.end(), [&](const Affine& half) {
        return std::none_of(polygon.begin(), polygon.end(),
                            [&](const Place& p) { return half.at(p) > 0; });
    });
}

/// The parts of convex pieces outside a convex region. Pieces that do not meet it stay whole.
std::vector<Polygon> without(std::vector<Polygon> pieces, const std::vector<Affine>& region) {
    std::vector<Polygon> left;
    for (Polygon& rest : pieces) {
        if (is_beyond(rest, region) || !is_wide(clipped(rest, region))) {
            left.push_back(std::move(rest));
            continue;
        }
        for (const Affine& half : region) {
            Polygon outside = clipped(rest, -half);
            if (is_wide(outside)) left.push_back(std::move(outside));
            rest = clipped(rest, half);
        }
    }
    return left;
}

double length2(const dvec3& p) { return p.x * p.x + p.y * p.y; }

/// Positive to the left of the way from p to q; the negative of that from q to p, bit for bit.
Affine line_through(const dvec3& p, const dvec3& q) {
    if (std::tie(q.x, q.y, q.z) < std::tie(p.x, p.y, p.z)) return -line_through(q, p);
    const double dx = q.x - p.x;
    const double dy = q.y - p.y;
    const double length = std::hypot(dx, dy);
    // From the nearer end, which rounds less.
    const dvec3& near = length2(p) < length2(q) ? p : q;
    return {-dy / length, dx / length, (dy * near.x - dx * near.y) / length};
}

double double_area(const Corners& p) {
    return (p[1].x - p[0].x) * (p[2].y - p[0].y) - (p[1].y - p[0].y) * (p[2].x - p[0].x);
}

std::vector<Affine> inside(const Corners& corner) {
    std::vector<Affine> halves;
    for (std::size_t i = 0; i < 3; ++i) {
        const Affine line = line_through(corner[i], corner[(i + 1) % 3]);
        halves.push_back(double_area(corner) < 0 ? -line : line);
    }
    return halves;
}

/// Whether all corners are on the far side of a line beside the circle of radius 1.
bool is_aside(const Corners& p) {
    for (int axis = 0; axis < 2; ++axis) {
        if ((p[0][axis] > 1 && p[1][axis] > 1 && p[2][axis] > 1) ||
            (p[0][axis] < -1 && p[1][axis] < -1 && p[2][axis] < -1)) {
            return true;
        }
    }
    return false;
}

/// t of the ray on the triangle's plane.
Affine depth(const Corners& p) {
    const auto nearest = static_cast<std::size_t>(
        std::min_element(p.begin(), p.end(),
                         [](const dvec3& a, const dvec3& b) { return length2(a) < length2(b); }) -
        p.begin());
    const dvec3& o = p[nearest];
    const dvec3 e = p[(nearest + 1) % 3] - o;
    const dvec3 f = p[(nearest + 2) % 3] - o;
    const double area = double_area(p);
    const double a = (e.z * f.y - f.z * e.y) / area;
    const double b = (e.x * f.z - f.x * e.z) / area;
    return {a, b, o.z - a * o.x - b * o.y};
}

void add_range(const Ray& ray, const Affine& t, std::vector<Affine>& halves) {
    halves.push_back({t.a, t.b, t.c - ray.tnear});
    if (std::isfinite(ray.tfar)) halves.push_back({-t.a, -t.b, ray.tfar - t.c});
}

dvec3 unit_cross(const dvec3& a, const dvec3& b) {
    const dvec3 c = glm::cross(a, b);
    return c / glm::length(c);
}

}  // namespace

ParallelView::ParallelView(const Ray& ray) : ray_(ray) {
    const dvec3 d(ray.dir);
    along_ = d / glm::dot(d, d);
    int least = 0;
    for (int i = 1; i < 3; ++i)
        if (std::abs(d[i]) < std::abs(d[least])) least = i;
    dvec3 axis(0, 0, 0);
    axis[least] = 1;
    x_ = unit_cross(d, axis);
    y_ = unit_cross(d, x_);
}

dvec3 ParallelView::seen(vec3 p) const {
    const dvec3 a = dvec3(p) - dvec3(ray_.org);
    return {glm::dot(a, x_), glm::dot(a, y_), glm::dot(a, along_)};
}

void ParallelView::add(std::uint32_t prim_id, vec3 a, vec3 b, vec3 c) {
    const Corners corner{seen(a), seen(b), seen(c)};
    if (double_area(corner) != 0) triangles_.push_back({prim_id, corner});
}

bool ParallelView::grazes(vec3 a, vec3 b, vec3 c, double radius, double most_t, double ulps) const {
    const Corners corner{seen(a), seen(b), seen(c)};
    for (std::size_t i = 0; i < 3; ++i) {
        const dvec3& p = corner[i];
        const dvec3 way = corner[(i + 1) % 3] - p;
        const double across2 = length2(way);
        const double at = across2 > 0 ? -(p.x * way.x + p.y * way.y) / across2 : 0;
        const dvec3 nearest = p + std::clamp(at, 0.0, 1.0) * way;
        const double t = nearest.z;
        if (std::hypot(nearest.x, nearest.y) <= radius && t > 0 && t >= ray_.tnear &&
            t <= ray_.tfar && t <= most_t + ulps * ulp_of(t))
            return true;
    }
    return false;
}

bool ParallelView::shows(std::uint32_t prim_id, double radius, double ulps) const {
    Polygon circle;
    for (int i = 0; i < kCircleCorners; ++i) {
        const double angle = 2 * std::numbers::pi * i / kCircleCorners;
        circle.push_back({std::cos(angle), std::sin(angle)});
    }
    const auto in_radii = [radius](Corners corner) {
        for (dvec3& p : corner) p /= dvec3(radius, radius, 1);
        return corner;
    };
    std::vector<Polygon> free{circle};
    Affine limit{};
    if (prim_id != kNoPrim) {
        const auto wanted = std::find_if(triangles_.begin(), triangles_.end(),
                                         [&](const Seen& one) { return one.prim_id == prim_id; });
        if (wanted == triangles_.end()) return false;
        const Corners corner = in_radii(wanted->corner);
        std::vector<Affine> halves = inside(corner);
        limit = depth(corner);
        add_range(ray_, limit, halves);
        free.front() = clipped(free.front(), halves);
        if (!is_wide(free.front())) return false;
        limit.c -= ulps * ulp_of(limit.at(free.front().front()));
    }
    for (const Seen& one : triangles_) {
        if (one.prim_id == prim_id) continue;
        const Corners corner = in_radii(one.corner);
        if (is_aside(corner)) continue;
        std::vector<Affine> halves = inside(corner);
        const Affine t = depth(corner);
        add_range(ray_, t, halves);
        if (prim_id != kNoPrim) halves.push_back({limit.a - t.a, limit.b - t.b, limit.c - t.c});
        free = without(std::move(free), halves);
        if (free.empty()) return false;
    }
    return true;
}

}  // namespace mray::accuracy
