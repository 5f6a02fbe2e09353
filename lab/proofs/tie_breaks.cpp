// One owner for each crossing (docs/design/arithmetic.md, "One owner").
//
//   bounds       the signs of is_left_of_edge are those for the ray at P = (e, e^2), for every e
//                that is small enough; so of the triangles around an edge or a vertex exactly as
//                many own a ray as pass P
//   code         is_left_of_edge, owns_ray (common/interop/tie_break_rule.h): the code's text
//   inputs       all pairs and triples of points of a grid around the ray; the signs of edge
//                functions are exact there
//   method       e = 1/1000: e and e^2 times differences of the grid are smaller than the steps of
//                what comes before them, so that the sign at P is the limit's. In integers.
//   by hand      The sign depends on the signs of A.x B.y - A.y B.x, A.y - B.y and B.x - A.x alone,
//                and all combinations that points can have occur on the grid.
#include <array>
#include <cstdint>
#include <cstdio>
#include <vector>

#include "common/interop/tie_break_rule.h"

namespace mray::proofs {
namespace {

constexpr int kReach = 3;

/// The edge function of a and b at P times 10^6, for e = 1/1000.
std::int64_t moved_edge(const vec3& a, const vec3& b) {
    // Doubles hold these integers.
    const glm::dvec3 p(a);
    const glm::dvec3 q(b);
    return static_cast<std::int64_t>(1e6 * (p.x * q.y - p.y * q.x) + 1e3 * (p.y - q.y) +
                                     (q.x - p.x));
}

std::vector<vec3> grid() {
    std::vector<vec3> points;
    for (int x = -kReach; x <= kReach; ++x)
        for (int y = -kReach; y <= kReach; ++y)
            points.emplace_back(static_cast<float>(x), static_cast<float>(y), 1.0f);
    return points;
}

bool has_point_in_the_right_places(const std::vector<vec3>& points) {
    std::int64_t wrong = 0;
    for (const vec3& a : points) {
        for (const vec3& b : points) {
            const std::int64_t moved = moved_edge(a, b);
            const float e = a.x * b.y - a.y * b.x;
            wrong += is_left_of_edge(e, a, b) != (moved > 0);
            wrong += (moved == 0) != (a == b);
        }
    }
    std::printf("edges: %lld wrong\n", static_cast<long long>(wrong));
    return wrong == 0;
}

bool owns_if_it_holds_the_point(const std::vector<vec3>& points) {
    std::int64_t wrong = 0;
    std::int64_t owners = 0;
    for (const vec3& a : points) {
        for (const vec3& b : points) {
            for (const vec3& c : points) {
                const std::array<std::int64_t, 3> moved = {moved_edge(b, c), moved_edge(c, a),
                                                           moved_edge(a, b)};
                const bool holds = (moved[0] > 0 && moved[1] > 0 && moved[2] > 0) ||
                                   (moved[0] < 0 && moved[1] < 0 && moved[2] < 0);
                const bool owns = owns_ray(exact_edges(a, b, c), a, b, c);
                wrong += owns != holds;
                owners += owns;
                // An owner is hit by the closed rule, too.
                const Edges e = exact_edges(a, b, c);
                const bool is_closed = may_be_inside(e) && (e.u != 0 || e.v != 0 || e.w != 0);
                wrong += owns && !is_closed;
            }
        }
    }
    std::printf("triangles: %lld own the ray, %lld wrong\n", static_cast<long long>(owners),
                static_cast<long long>(wrong));
    return wrong == 0;
}

}  // namespace
}  // namespace mray::proofs

int main() {
    const std::vector<mray::vec3> points = mray::proofs::grid();
    const bool edges = mray::proofs::has_point_in_the_right_places(points);
    const bool triangles = mray::proofs::owns_if_it_holds_the_point(points);
    return edges && triangles ? 0 : 1;
}
