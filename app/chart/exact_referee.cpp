#include "app/chart/exact_referee.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numbers>
#include <numeric>

namespace morphray::app {
namespace {

constexpr double kCloseUlps = 4;
// Of the size of a triangle across the ray, and of the distance of its corners: twice what the rule
// displaces vertices by (docs/arithmetic.md, "A vertex is one point").
constexpr double kDisplacement = 0x1p-21;
constexpr double kFarDisplacement = 0x1p-43;
// Nearer to an edge than this a surface that is missed is one that was slipped through.
constexpr double kNearEdge = 0x1p-12;
// Lines around the ray that are looked along.
constexpr int kAround = 24;

bool is_usable(vec3 p) {
    const bool invalid =
        p.x == kInvalidCoordinate && p.y == kInvalidCoordinate && p.z == kInvalidCoordinate;
    return std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z) && !invalid;
}

double ulp_of(double t) {
    const auto x = static_cast<float>(t);
    return static_cast<double>(std::nextafter(x, INFINITY)) - x;
}

/// Where the triangles of a few candidates lie as seen along a ray, in double.
struct SeenTriangle {
    std::uint32_t prim_id;
    std::array<Double3, 3> corner;  // x, y across the ray, z along it in units of t

    /// t at which the line through (x, y) meets it, or nothing.
    std::optional<double> t_at(double x, double y) const {
        std::array<double, 3> weight;
        for (std::size_t i = 0; i < 3; ++i) {
            const Double3& p = corner[(i + 1) % 3];
            const Double3& q = corner[(i + 2) % 3];
            weight[i] = (p[0] - x) * (q[1] - y) - (p[1] - y) * (q[0] - x);
        }
        const auto [least, most] = std::minmax_element(weight.begin(), weight.end());
        if ((*least < 0 && *most > 0) || (*least == 0 && *most == 0)) return std::nullopt;
        const double sum = weight[0] + weight[1] + weight[2];
        return (weight[0] * corner[0][2] + weight[1] * corner[1][2] + weight[2] * corner[2][2]) /
               sum;
    }
};

/// Axes across a ray.
struct Across {
    Double3 org, x, y, along;

    explicit Across(const Ray& ray) : org{ray.org.x, ray.org.y, ray.org.z} {
        const Double3 d{ray.dir.x, ray.dir.y, ray.dir.z};
        const double length2 = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
        for (std::size_t i = 0; i < 3; ++i) along[i] = d[i] / length2;
        const auto least = static_cast<std::size_t>(
            std::min_element(d.begin(), d.end(),
                             [](double a, double b) { return std::abs(a) < std::abs(b); }) -
            d.begin());
        Double3 axis{0, 0, 0};
        axis[least] = 1;
        x = unit_cross(d, axis);
        y = unit_cross(d, x);
    }

    Double3 seen(vec3 p) const {
        const Double3 a{p.x - org[0], p.y - org[1], p.z - org[2]};
        const auto dot = [&a](const Double3& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; };
        return {dot(x), dot(y), dot(along)};
    }

private:
    static Double3 unit_cross(const Double3& a, const Double3& b) {
        Double3 c{a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
        const double length = std::sqrt(c[0] * c[0] + c[1] * c[1] + c[2] * c[2]);
        for (double& component : c) component /= length;
        return c;
    }
};

}  // namespace

const char* name_of(Verdict verdict) {
    constexpr const char* kNames[kVerdictCount] = {
        "right", "close", "displaced", "wrong triangle", "false miss", "false hit", "leak"};
    return kNames[static_cast<std::size_t>(verdict)];
}

bool is_wrong(Verdict verdict) { return verdict > Verdict::kDisplaced; }

ExactReferee::ExactReferee(const Topology& topology, std::span<const vec3> positions,
                           const Bvh& bvh)
    : topology_(&topology), positions_(positions), search_(bvh) {
    for (const uvec3& t : topology.triangles) {
        const vec3 a = positions[t.x];
        const vec3 b = positions[t.y];
        const vec3 c = positions[t.z];
        usable_.push_back(is_usable(a) && is_usable(b) && is_usable(c) && a != b && b != c &&
                          c != a);
    }
}

ExactTriangle ExactReferee::triangle(const Ray& ray, std::uint32_t prim_id) const {
    const uvec3 t = topology_->triangles[prim_id];
    return {ray, positions_[t.x], positions_[t.y], positions_[t.z]};
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
    std::vector<std::uint32_t> candidates;
    search_.find(ray, 0, candidates);
    return closest_of(ray, candidates);
}

Truth ExactReferee::closest_of_all(const Ray& ray) const {
    std::vector<std::uint32_t> all(topology_->triangles.size());
    std::iota(all.begin(), all.end(), 0u);
    return closest_of(ray, all);
}

// Shifting the line moves all vertices alike, so a closed mesh stays closed: no leak is excused.
bool ExactReferee::seen_nearby(const Ray& ray, const Truth& truth, std::uint32_t prim_id) const {
    double size = 0;
    double t_wanted = 0;
    double reach = 0;
    const Across across(ray);
    for (const std::uint32_t id : {truth.prim_id, prim_id}) {
        if (id == kNoPrim) continue;
        if (usable_[id] == 0) return false;
        const ExactTriangle one = triangle(ray, id);
        size = std::max(size, one.size());
        if (id == prim_id && one.has_t()) t_wanted = one.t();
        for (const vec3 p :
             {positions_[topology_->triangles[id].x], positions_[topology_->triangles[id].y],
              positions_[topology_->triangles[id].z]}) {
            reach = std::max(reach, largest_magnitude(p - ray.org));
        }
    }
    const double shift = kDisplacement * size + kFarDisplacement * reach;
    std::vector<std::uint32_t> candidates;
    search_.find(ray, 2 * shift, candidates);
    std::vector<SeenTriangle> seen;
    for (const std::uint32_t id : candidates) {
        const uvec3 t = topology_->triangles[id];
        if (usable_[id] == 0) continue;
        seen.push_back({id,
                        {across.seen(positions_[t.x]), across.seen(positions_[t.y]),
                         across.seen(positions_[t.z])}});
    }
    for (int i = 0; i < kAround; ++i) {
        const double angle = 2 * std::numbers::pi * i / kAround;
        // Two rings: what is seen only very near the ray counts too.
        const double radius = i % 2 == 0 ? shift : 0.25 * shift;
        std::uint32_t winner = kNoPrim;
        double winner_t = INFINITY;
        for (const SeenTriangle& one : seen) {
            const std::optional<double> t =
                one.t_at(radius * std::cos(angle), radius * std::sin(angle));
            if (!t || *t <= 0 || *t < ray.tnear || *t > ray.tfar || *t >= winner_t) continue;
            winner = one.prim_id;
            winner_t = *t;
        }
        if (winner == prim_id) return true;
        if (winner != kNoPrim && prim_id != kNoPrim &&
            std::abs(winner_t - t_wanted) <= kCloseUlps * ulp_of(winner_t)) {
            return true;
        }
    }
    return false;
}

Judgement ExactReferee::judge(const Ray& ray, const Truth& truth, std::uint32_t prim_id) const {
    if (prim_id == truth.prim_id) return {};
    const std::optional<ExactTriangle> expected =
        truth.hit() ? std::optional(triangle(ray, truth.prim_id)) : std::nullopt;
    const std::optional<ExactTriangle> answered = prim_id != kNoPrim && usable_[prim_id] != 0
                                                      ? std::optional(triangle(ray, prim_id))
                                                      : std::nullopt;
    Judgement judgement;
    if (expected && answered && answered->has_t()) {
        const bool is_hit = answered->is_met() && answered->in_range();
        if (is_hit && answered->compare_t(*expected) == 0) return {};
        judgement.t_ulps = (answered->t() - truth.t) / ulp_of(truth.t);
        if (is_hit && judgement.t_ulps <= kCloseUlps) judgement.verdict = Verdict::kClose;
    }
    judgement.edge_distance = expected   ? expected->edge_distance()
                              : answered ? answered->edge_distance()
                                         : 0;
    if (judgement.verdict == Verdict::kClose) return judgement;
    const bool passes = prim_id == kNoPrim || judgement.t_ulps > kCloseUlps;
    if (seen_nearby(ray, truth, prim_id)) {
        judgement.verdict = Verdict::kDisplaced;
    } else if (!truth.hit()) {
        judgement.verdict = Verdict::kFalseHit;
    } else if (passes && std::abs(judgement.edge_distance) < kNearEdge) {
        judgement.verdict = Verdict::kLeak;
    } else {
        judgement.verdict = prim_id == kNoPrim ? Verdict::kFalseMiss : Verdict::kWrongTriangle;
    }
    return judgement;
}

}  // namespace morphray::app
