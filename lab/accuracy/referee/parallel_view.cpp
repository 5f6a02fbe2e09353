#include "lab/accuracy/referee/parallel_view.h"

#include <algorithm>
#include <cmath>
#include <numbers>

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

/// The square of the distance from the ray.
double length2(const Double3& p) { return p[0] * p[0] + p[1] * p[1]; }

/// Positive to the left of the way from p to q; the negative of that from q to p, bit for bit.
Affine line_through(const Double3& p, const Double3& q) {
    if (q < p) return -line_through(q, p);
    const double dx = q[0] - p[0];
    const double dy = q[1] - p[1];
    const double length = std::hypot(dx, dy);
    // From the nearer end, which rounds less.
    const Double3& near = length2(p) < length2(q) ? p : q;
    return {-dy / length, dx / length, (dy * near[0] - dx * near[1]) / length};
}

double double_area(const std::array<Double3, 3>& p) {
    return (p[1][0] - p[0][0]) * (p[2][1] - p[0][1]) - (p[1][1] - p[0][1]) * (p[2][0] - p[0][0]);
}

std::vector<Affine> inside(const std::array<Double3, 3>& corner) {
    std::vector<Affine> halves;
    for (std::size_t i = 0; i < 3; ++i) {
        const Affine line = line_through(corner[i], corner[(i + 1) % 3]);
        halves.push_back(double_area(corner) < 0 ? -line : line);
    }
    return halves;
}

/// Whether all corners are on the far side of a line beside the circle of radius 1.
bool is_aside(const std::array<Double3, 3>& p) {
    for (std::size_t axis = 0; axis < 2; ++axis) {
        if ((p[0][axis] > 1 && p[1][axis] > 1 && p[2][axis] > 1) ||
            (p[0][axis] < -1 && p[1][axis] < -1 && p[2][axis] < -1)) {
            return true;
        }
    }
    return false;
}

/// t of the ray on the triangle's plane.
Affine depth(const std::array<Double3, 3>& p) {
    const auto nearest =
        static_cast<std::size_t>(std::min_element(p.begin(), p.end(),
                                                  [](const Double3& a, const Double3& b) {
                                                      return length2(a) < length2(b);
                                                  }) -
                                 p.begin());
    const Double3& o = p[nearest];
    Double3 e, f;
    for (std::size_t i = 0; i < 3; ++i) {
        e[i] = p[(nearest + 1) % 3][i] - o[i];
        f[i] = p[(nearest + 2) % 3][i] - o[i];
    }
    const double area = double_area(p);
    const double a = (e[2] * f[1] - f[2] * e[1]) / area;
    const double b = (e[0] * f[2] - f[0] * e[2]) / area;
    return {a, b, o[2] - a * o[0] - b * o[1]};
}

/// The half-planes in which t is within the ray's range.
void add_range(const Ray& ray, const Affine& t, std::vector<Affine>& halves) {
    halves.push_back({t.a, t.b, t.c - ray.tnear});
    if (std::isfinite(ray.tfar)) halves.push_back({-t.a, -t.b, ray.tfar - t.c});
}

Double3 unit_cross(const Double3& a, const Double3& b) {
    Double3 c{a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
    const double length = std::sqrt(c[0] * c[0] + c[1] * c[1] + c[2] * c[2]);
    for (double& component : c) component /= length;
    return c;
}

}  // namespace

ParallelView::ParallelView(const Ray& ray) : ray_(ray) {
    const Double3 d{ray.dir.x, ray.dir.y, ray.dir.z};
    const double length2 = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
    for (std::size_t i = 0; i < 3; ++i) along_[i] = d[i] / length2;
    const auto least = static_cast<std::size_t>(
        std::min_element(d.begin(), d.end(),
                         [](double a, double b) { return std::abs(a) < std::abs(b); }) -
        d.begin());
    Double3 axis{0, 0, 0};
    axis[least] = 1;
    x_ = unit_cross(d, axis);
    y_ = unit_cross(d, x_);
}

Double3 ParallelView::seen(vec3 p) const {
    const Double3 a{double{p.x} - ray_.org.x, double{p.y} - ray_.org.y, double{p.z} - ray_.org.z};
    const auto dot = [&a](const Double3& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; };
    return {dot(x_), dot(y_), dot(along_)};
}

void ParallelView::add(std::uint32_t prim_id, vec3 a, vec3 b, vec3 c) {
    const std::array<Double3, 3> corner{seen(a), seen(b), seen(c)};
    if (double_area(corner) != 0) triangles_.push_back({prim_id, corner});
}

bool ParallelView::grazes(vec3 a, vec3 b, vec3 c, double radius, double most_t, double ulps) const {
    const std::array<Double3, 3> corner{seen(a), seen(b), seen(c)};
    for (std::size_t i = 0; i < 3; ++i) {
        const Double3& p = corner[i];
        const Double3& q = corner[(i + 1) % 3];
        const double dx = q[0] - p[0];
        const double dy = q[1] - p[1];
        const double length2 = dx * dx + dy * dy;
        const double at = length2 > 0 ? -(p[0] * dx + p[1] * dy) / length2 : 0;
        const double part = std::clamp(at, 0.0, 1.0);
        const double t = p[2] + part * (q[2] - p[2]);
        if (std::hypot(p[0] + part * dx, p[1] + part * dy) <= radius && t > 0 && t >= ray_.tnear &&
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
    const auto in_radii = [radius](std::array<Double3, 3> corner) {
        for (Double3& p : corner) {
            p[0] /= radius;
            p[1] /= radius;
        }
        return corner;
    };
    std::vector<Polygon> free{circle};
    Affine limit{};
    if (prim_id != kNoPrim) {
        const auto wanted = std::find_if(triangles_.begin(), triangles_.end(),
                                         [&](const Seen& one) { return one.prim_id == prim_id; });
        if (wanted == triangles_.end()) return false;
        const std::array<Double3, 3> corner = in_radii(wanted->corner);
        std::vector<Affine> halves = inside(corner);
        limit = depth(corner);
        add_range(ray_, limit, halves);
        free.front() = clipped(free.front(), halves);
        if (!is_wide(free.front())) return false;
        limit.c -= ulps * ulp_of(limit.at(free.front().front()));
    }
    for (const Seen& one : triangles_) {
        if (one.prim_id == prim_id) continue;
        const std::array<Double3, 3> corner = in_radii(one.corner);
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
