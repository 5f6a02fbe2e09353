#include "lab/accuracy/exact_referee.h"

#include <gmpxx.h>

#include <cmath>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <numbers>
#include <optional>
#include <tuple>

#include "common/bvh/builder/binary_tree.h"

namespace mray::lab {
namespace {

// The intersection of a ray with a triangle.

// A determinant of three rounded differences, its products and its sums: 8 roundings of at most
// 2^-53 of the sum of the products' magnitudes, and again as much for their products.
constexpr double kDeterminantError = 0x1p-49;

constexpr std::size_t kSum = 3;
constexpr std::size_t kVolume = 4;

/// The sign of a value that is off by at most `error`; that of exact() where this does not decide.
template <class Exact>
int decide(double value, double error, const Exact& exact) {
    if (std::abs(value) > error) return value > 0 ? 1 : -1;
    return exact();
}

thread_local std::uint64_t exact_counter = 0;

/// Every float times 2 to this power is an integer.
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
    // Sets a value to p . (q x r).
    const auto set = [&](std::size_t at, const dvec3& p, const dvec3& q, const dvec3& r) {
        double magnitude = 0;
        for (int i = 0; i < 3; ++i) {
            const int j = (i + 1) % 3;
            const int k = (i + 2) % 3;
            const double left = q[j] * r[k];
            const double right = q[k] * r[j];
            value_[at] += p[i] * (left - right);
            magnitude += std::abs(p[i]) * (std::abs(left) + std::abs(right));
        }
        error_[at] = kDeterminantError * magnitude;
    };
    for (std::size_t edge = 0; edge < 3; ++edge) {
        set(edge, dvec3(ray.dir), relative_[(edge + 1) % 3], relative_[(edge + 2) % 3]);
        value_[kSum] += value_[edge];
        // Two more roundings, of less than twice the error's own reserve.
        error_[kSum] += 2 * error_[edge];
    }
    set(kVolume, relative_[0], relative_[1], relative_[2]);
}

std::uint64_t ExactTriangle::exact_count() { return exact_counter; }

const ExactTriangle::Integers& ExactTriangle::integers() const {
    if (integers_ != nullptr) return *integers_;
    ++exact_counter;
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
    for (std::size_t edge = 0; edge < 3; ++edge)
        made->value[edge] = exact(dir, p[(edge + 1) % 3], p[(edge + 2) % 3]);
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

double ExactTriangle::over_sum(std::size_t i, double precise) const {
    const double size = std::abs(value_[i == kVolume ? i : kSum]);
    if (error_[i] < precise * size && error_[kSum] < precise * std::abs(value_[kSum]))
        return value_[i] / value_[kSum];
    return integers().value[i].get_d() / integers().value[kSum].get_d();
}

// To a small part of a float's ulp.
double ExactTriangle::t() const { return over_sum(kVolume, 0x1p-28); }

dvec3 ExactTriangle::hit() const {
    constexpr double kPrecise = 0x1p-34;
    return {over_sum(kVolume, kPrecise), over_sum(1, kPrecise), over_sum(2, kPrecise)};
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

namespace {

// Triangles projected along a ray.

// The circle as a polygon inside it, at most 1 in 800 too small.
constexpr int kCircleCorners = 64;
// In radii of the circle. Corners are up to 2^21 radii away and doubles round them to 2^-31, so a
// gap that rounding leaves between two regions that meet is far narrower than this.
constexpr double kNarrow = 0x1p-16;

using glm::dvec2;
using Polygon = std::vector<dvec2>;  // convex
using Corners = std::array<dvec3, 3>;

/// The half-plane where a x + b y + c is not negative.
struct Affine {
    double a, b, c;

    double at(const dvec2& p) const { return a * p.x + b * p.y + c; }
    Affine operator-() const { return {-a, -b, -c}; }
};

Polygon clipped(const Polygon& polygon, const Affine& half) {
    Polygon result;
    for (std::size_t i = 0; i < polygon.size(); ++i) {
        const dvec2& p = polygon[i];
        const dvec2& q = polygon[(i + 1) % polygon.size()];
        const double here = half.at(p);
        const double there = half.at(q);
        if (here >= 0) result.push_back(p);
        if ((here < 0) == (there < 0)) continue;
        result.push_back(p + here / (here - there) * (q - p));
    }
    return result;
}

double cross2(const dvec2& p, const dvec2& q) { return p.x * q.y - p.y * q.x; }

bool is_wide(const Polygon& polygon) {
    double area = 0;
    double around = 0;
    for (std::size_t i = 0; i < polygon.size(); ++i) {
        const dvec2& p = polygon[i];
        const dvec2& q = polygon[(i + 1) % polygon.size()];
        area += cross2(p - polygon[0], q - polygon[0]);
        around += glm::distance(p, q);
    }
    return area > kNarrow * around;
}

Polygon clipped(Polygon polygon, const std::vector<Affine>& region) {
    for (const Affine& half : region) polygon = clipped(polygon, half);
    return polygon;
}

/// The parts of convex pieces outside a convex region. Pieces that do not meet it stay whole.
std::vector<Polygon> without(std::vector<Polygon> pieces, const std::vector<Affine>& region) {
    std::vector<Polygon> left;
    for (Polygon& rest : pieces) {
        if (!is_wide(clipped(rest, region))) {
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

double length2(const dvec2& p) { return glm::dot(p, p); }

/// Positive to the left of the way from p to q; the negative of that from q to p, bit for bit.
Affine line_through(const dvec3& p, const dvec3& q) {
    if (std::tie(q.x, q.y, q.z) < std::tie(p.x, p.y, p.z)) return -line_through(q, p);
    const dvec2 way(q - p);
    const double length = std::hypot(way.x, way.y);
    // From the nearer end, which rounds less.
    const dvec2 near(length2(p) < length2(q) ? p : q);
    return {-way.y / length, way.x / length, cross2(near, way) / length};
}

double double_area(const Corners& p) { return cross2(p[1] - p[0], p[2] - p[0]); }

std::vector<Affine> inside(const Corners& corner) {
    std::vector<Affine> halves;
    for (std::size_t i = 0; i < 3; ++i) {
        const Affine line = line_through(corner[i], corner[(i + 1) % 3]);
        halves.push_back(double_area(corner) < 0 ? -line : line);
    }
    return halves;
}

/// t of the ray on the triangle's plane.
Affine depth(const Corners& p) {
    const auto nearest =
        static_cast<std::size_t>(std::ranges::min_element(p, {}, length2) - p.begin());
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

}  // namespace

ParallelView::ParallelView(const Ray& ray) : ray_(ray) {
    const dvec3 d(ray.dir);
    along_ = d / glm::dot(d, d);
    int least = 0;
    for (int i = 1; i < 3; ++i)
        if (std::abs(d[i]) < std::abs(d[least])) least = i;
    dvec3 axis(0, 0, 0);
    axis[least] = 1;
    x_ = glm::normalize(glm::cross(d, axis));
    y_ = glm::normalize(glm::cross(d, x_));
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
        const auto wanted = std::ranges::find(triangles_, prim_id, &Seen::prim_id);
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
        std::vector<Affine> halves = inside(corner);
        const Affine t = depth(corner);
        add_range(ray_, t, halves);
        if (prim_id != kNoPrim) halves.push_back({limit.a - t.a, limit.b - t.b, limit.c - t.c});
        free = without(std::move(free), halves);
        if (free.empty()) return false;
    }
    return true;
}

namespace {

// Answers and verdicts.

constexpr double kCloseUlps = 4;
// In sizes of a triangle across the ray, and in distances of its corners: twice the displacement of
// vertices by the rule (docs/design/arithmetic.md, "A vertex is one point").
constexpr double kDisplacement = 0x1p-21;
constexpr double kFarDisplacement = 0x1p-43;
// In sizes of a triangle: within it a miss is a leak, a hit at that depth a neighbour's.
constexpr double kNearEdge = 0x1p-12;

// Far above the 2^-53 of a double, far below the resolution of a tracer in float.
constexpr double kRounding = 0x1p-40;

bool meets(const PeerNode& node, const Ray& ray, double margin) {
    double enter = 0;
    double leave = INFINITY;
    for (int axis = 0; axis < 3; ++axis) {
        const double lower = node.lower[axis] - margin - ray.org[axis];
        const double upper = node.upper[axis] + margin - ray.org[axis];
        const double dir = ray.dir[axis];
        // A ray parallel to the slab is inside or outside.
        if (dir == 0 && (lower > 0 || upper < 0)) return false;
        if (dir == 0) continue;
        // Quotients have a relative error of about 2^-52.
        const auto [first, last] = std::minmax({lower / dir, upper / dir});
        enter = std::max(enter, first - std::abs(first) * kRounding);
        leave = std::min(leave, last + std::abs(last) * kRounding);
    }
    return enter <= leave;
}

double largest_magnitude(vec3 v) {
    return std::max({std::abs(double{v.x}), std::abs(double{v.y}), std::abs(double{v.z})});
}

bool is_usable(vec3 p) {
    return std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z) &&
           p != vec3(kInvalidCoordinate);
}

}  // namespace

std::vector<std::uint32_t> ExactReferee::find_candidates(const Ray& ray, double margin) const {
    std::vector<std::uint32_t> found;
    if (tree_->nodes.empty()) return found;
    const double around = margin + kRounding * (largest_ + largest_magnitude(ray.org));
    std::array<std::uint32_t, kMaxBinaryHeight + 2> stack = {0};
    std::size_t size = 1;
    while (size != 0) {
        const PeerNode& node = tree_->nodes[stack[--size]];
        if (!meets(node, ray, around)) continue;
        for (std::uint32_t i = node.first; i < node.first + node.count; ++i)
            found.push_back(tree_->triangles[i].prim_id);
        if (node.count != 0) continue;
        stack[size++] = node.first;
        stack[size++] = node.first + 1;
    }
    return found;
}

double ulp_of(double t) {
    const auto x = static_cast<float>(std::abs(t));
    return static_cast<double>(std::nextafter(x, INFINITY)) - x;
}

bool is_wrong(Verdict verdict) { return verdict > Verdict::kBeside; }

ExactReferee::ExactReferee(const Topology& topology, std::span<const vec3> positions,
                           const PeerTree& tree)
    : topology_(&topology), positions_(positions), tree_(&tree) {
    if (!tree.nodes.empty())
        largest_ = std::max(largest_magnitude(tree.nodes[0].lower),
                            largest_magnitude(tree.nodes[0].upper));
    for (std::uint32_t id = 0; id < topology.triangles.size(); ++id) {
        const auto [a, b, c] = corners(id);
        usable_.push_back(is_usable(a) && is_usable(b) && is_usable(c) && a != b && b != c &&
                          c != a);
    }
}

std::array<vec3, 3> ExactReferee::corners(std::uint32_t prim_id) const {
    const uvec3 t = topology_->triangles[prim_id];
    return {positions_[t.x], positions_[t.y], positions_[t.z]};
}

ExactTriangle ExactReferee::triangle(const Ray& ray, std::uint32_t prim_id) const {
    const auto [a, b, c] = corners(prim_id);
    return {ray, a, b, c};
}

Truth ExactReferee::closest_of(const Ray& ray, std::span<const std::uint32_t> candidates) const {
    if (ray.dir == vec3(0, 0, 0)) return {};
    Truth truth;
    std::optional<ExactTriangle> best;
    for (const std::uint32_t prim_id : candidates) {
        if (usable_[prim_id] == 0) continue;
        ExactTriangle next = triangle(ray, prim_id);
        if (!next.is_met() || !next.in_range()) continue;
        const int order = best ? next.compare_t(*best) : -1;
        if (order > 0 || (order == 0 && prim_id > truth.prim_id)) continue;
        best = std::move(next);
        truth.prim_id = prim_id;
    }
    if (best) truth.t = best->t();
    return truth;
}

Truth ExactReferee::closest(const Ray& ray) const {
    return closest_of(ray, find_candidates(ray, 0));
}

// Shifting the line displaces all vertices equally, so that a leak never counts as displaced.
bool ExactReferee::seen_nearby(const Ray& ray, const Truth& truth, std::uint32_t prim_id) const {
    double size = 0;
    double reach = 0;
    for (const std::uint32_t id : {truth.prim_id, prim_id}) {
        if (id == kNoPrim) continue;
        if (usable_[id] == 0) return false;
        size = std::max(size, triangle(ray, id).size());
        for (const vec3& p : corners(id)) reach = std::max(reach, largest_magnitude(p - ray.org));
    }
    const double radius = kDisplacement * size + kFarDisplacement * reach;
    ParallelView view(ray);
    for (const std::uint32_t id : find_candidates(ray, 2 * radius)) {
        const auto [a, b, c] = corners(id);
        if (usable_[id] != 0) view.add(id, a, b, c);
    }
    if (view.shows(prim_id, radius, kCloseUlps)) return true;
    if (prim_id == kNoPrim || triangle(ray, prim_id).has_t()) return false;
    const auto [a, b, c] = corners(prim_id);
    return view.grazes(a, b, c, radius, truth.hit() ? truth.t : INFINITY, kCloseUlps);
}

Verdict ExactReferee::judge(const Ray& ray, const Truth& truth, std::uint32_t prim_id) const {
    if (prim_id == truth.prim_id) return Verdict::kRight;
    const std::optional<ExactTriangle> expected =
        truth.hit() ? std::optional(triangle(ray, truth.prim_id)) : std::nullopt;
    const std::optional<ExactTriangle> answered = prim_id != kNoPrim && usable_[prim_id] != 0
                                                      ? std::optional(triangle(ray, prim_id))
                                                      : std::nullopt;
    // The t of the answered plane exceeds the exact one by so many ulps.
    double t_ulps = 0;
    if (expected && answered && answered->has_t()) {
        const bool is_hit = answered->is_met() && answered->in_range();
        if (is_hit && answered->compare_t(*expected) == 0) return Verdict::kRight;
        t_ulps = (answered->t() - truth.t) / ulp_of(std::max(std::abs(answered->t()), truth.t));
        if (is_hit && t_ulps <= kCloseUlps) return Verdict::kClose;
    }
    if (seen_nearby(ray, truth, prim_id)) return Verdict::kDisplaced;
    if (!expected) return Verdict::kFalseHit;
    if (answered && answered->has_t() && std::abs(t_ulps) <= kCloseUlps &&
        answered->edge_distance() < kNearEdge)
        return Verdict::kBeside;
    const bool passes = prim_id == kNoPrim || t_ulps > kCloseUlps;
    if (passes && expected->edge_distance() < kNearEdge) return Verdict::kLeak;
    return prim_id == kNoPrim ? Verdict::kFalseMiss : Verdict::kWrongTriangle;
}

Verdict ExactReferee::judge_occlusion(const Ray& ray, const Truth& truth, bool occluded) const {
    if (occluded == truth.hit()) return Verdict::kRight;
    // Hits at the ends of the ray may be some ulp beyond them, or within.
    Ray near = ray;
    for (int i = 0; i < kCloseUlps; ++i) {
        near.tfar = std::nextafter(near.tfar, occluded ? INFINITY : 0.0f);
        near.tnear = std::nextafter(near.tnear, occluded ? 0.0f : INFINITY);
    }
    const Truth near_truth = closest(near);
    if (occluded == near_truth.hit()) return Verdict::kClose;
    if (!occluded) return judge(near, near_truth, kNoPrim);
    // The widest margin that any triangle can have.
    const double most = 4 * kDisplacement * (largest_ + largest_magnitude(ray.org));
    for (const std::uint32_t id : find_candidates(near, most))
        if (seen_nearby(near, near_truth, id)) return Verdict::kDisplaced;
    return Verdict::kFalseHit;
}

std::array<double, 3> ExactReferee::errors(const Ray& ray, const Hit& hit) const {
    const dvec3 exact = triangle(ray, hit.prim_id).hit();
    return {std::abs(hit.t - exact.x) / ulp_of(exact.x), std::abs(hit.u - exact.y) * 0x1p23,
            std::abs(hit.v - exact.z) * 0x1p23};
}

}  // namespace mray::lab
