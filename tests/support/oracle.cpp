#include "tests/support/oracle.h"

#include <algorithm>
#include <cmath>

#include <glm/geometric.hpp>

namespace mray::test {
namespace {

using Real = long double;

using Vector = glm::vec<3, Real>;

struct Crossing {
    bool inside = false;
    bool grazing = false;
    Real t = 0;
};

/// The distance of the line through the origin in the direction d from the edge p + s * e, 0 <= s
/// <= 1; t: where the line is nearest.
Real distance_to_edge(Vector d, Vector p, Vector e, Real& t) {
    const Real dd = dot(d, d);
    const auto across = [&](Vector v) { return v - dot(v, d) / dd * d; };
    const Vector q = across(p);
    const Vector f = across(e);
    const Real ff = dot(f, f);
    const Real s = ff > 0 ? std::clamp(-dot(q, f) / ff, Real{0}, Real{1}) : Real{0};
    t = (dot(p, d) + s * dot(e, d)) / dd;
    return length(q + s * f);
}

Crossing cross_triangle(const Ray& ray, vec3 a, vec3 b, vec3 c) {
    constexpr Real kEdge = 1e-6L;
    const Vector d(ray.dir);
    const Vector ab = Vector(b) - Vector(a);
    const Vector ac = Vector(c) - Vector(a);
    const Vector n = cross(ab, ac);
    const Real size = length(n);
    const Real facing = dot(d, n);
    Crossing result;
    const Vector oa = Vector(a) - Vector(ray.org);
    if (size == 0) {
        // Without an area it is hit only where rounding gives it one.
        const Vector edges[3][2] = {{oa, ab}, {oa + ab, ac - ab}, {oa + ac, -ac}};
        for (const auto& edge : edges) {
            const Real slack = kEdge * length(edge[1]) + 1e-13L * length(edge[0]);
            if (distance_to_edge(d, edge[0], edge[1], result.t) <= slack) {
                result.grazing = true;
                return result;
            }
        }
        return result;
    }
    if (std::abs(facing) <= 1e-12L * size * length(d)) {
        // Edge-on: it may be grazed only if the ray runs in its plane.
        result.grazing = std::abs(dot(oa, n)) <= 1e-6L * size * (length(oa) + 1);
        return result;
    }
    result.t = dot(oa, n) / facing;
    const Vector p = d * result.t - oa;
    const Real v = dot(cross(p, ac), n) / (size * size);
    const Real w = dot(cross(ab, p), n) / (size * size);
    const Real least = std::min(std::min(v, w), 1 - v - w);
    result.inside = least >= 0;
    // The tracer's coordinates relative to the ray are off by 2^-44 of the distance.
    const Real slack = kEdge + 1e-13L * (length(oa) + length(p)) * (length(ab) + length(ac)) / size;
    result.grazing = std::abs(least) <= slack;
    return result;
}

}  // namespace

OracleHit oracle_intersect(const TestScene& scene, const Ray& ray) {
    OracleHit best;
    Real nearest_deferred = INFINITY;
    Real second = INFINITY;
    for (std::uint32_t i = 0; i < scene.triangle_count(); ++i) {
        const uvec3 t = scene.topology().triangles[i];
        const vec3 a = scene.positions()[t.x];
        const vec3 b = scene.positions()[t.y];
        const vec3 c = scene.positions()[t.z];
        if (std::max({a.x, b.x, c.x}) > kSceneExtent) continue;
        const Crossing crossing = cross_triangle(ray, a, b, c);
        const bool in_range = crossing.t > 0 && crossing.t >= ray.tnear && crossing.t <= ray.tfar;
        const bool at_end =
            std::abs(crossing.t - ray.tfar) <= 1e-6L * ray.tfar || std::abs(crossing.t) <= 1e-3L;
        if ((crossing.grazing || (crossing.inside && at_end)) && crossing.t > -1)
            nearest_deferred = std::min(nearest_deferred, crossing.t);
        if (!crossing.inside || !in_range) continue;
        if (!best.hit || crossing.t < best.t) {
            if (best.hit) second = std::min(second, best.t);
            best = {true, crossing.t, i, false};
        } else {
            second = std::min(second, crossing.t);
        }
    }
    best.ambiguous = nearest_deferred <= (best.hit ? best.t * (1 + 1e-6L) : INFINITY) ||
                     (best.hit && second <= best.t * (1 + 1e-6L));
    if (std::isinf(nearest_deferred) && !best.hit) best.ambiguous = false;
    return best;
}

}  // namespace mray::test
