#include "common/scene/exact_crossing.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <set>
#include <utility>

#include "common/base/whole_vector.h"
#include "common/interop/tie_break_rule.h"

namespace mray {
namespace {

/// A sum of products in doubles, whose factors are at most four times rounded.
struct Sum {
    double value = 0;
    double size = 0;

    void add(double a, double b, double rounded_size) {
        value += a * b;
        size += std::abs(a) * rounded_size;
    }
    /// Exact zeros have no size; nothing underflows for differences of floats.
    bool has_sign() const { return std::abs(value) > 0x1p-48 * size || size == 0; }
    int sign() const { return (value > 0) - (value < 0); }
};

/// The edge function of a and b in the plane of x and y.
Sum edge_in_doubles(const glm::dvec3& a, const glm::dvec3& b) {
    Sum edge;
    edge.add(a.x, b.y, std::abs(b.y));
    edge.add(-a.y, b.x, std::abs(b.x));
    return edge;
}

/// The sign of the edge function of a and b, which is `sign`, for the moved point.
int moved_sign(int sign, vec3 a, vec3 b) {
    if (sign != 0) return sign;
    if (a.y != b.y) return a.y > b.y ? 1 : -1;
    if (a.x != b.x) return b.x > a.x ? 1 : -1;
    return 0;
}

bool any_opposite(const mpz_class& a, const mpz_class& b, const mpz_class& c) {
    const auto [least, most] = std::minmax({sgn(a), sgn(b), sgn(c)});
    return least < 0 && most > 0;
}

bool is_in_box(vec3 p, vec3 a, vec3 b, vec3 c) {
    for (int axis = 0; axis < 3; ++axis) {
        const auto [least, most] = std::minmax({a[axis], b[axis], c[axis]});
        if (p[axis] < least || p[axis] > most) return false;
    }
    return true;
}

using Place = std::array<float, 3>;
/// The ends of an edge, the lower one first; or a vertex twice.
using Border = std::pair<Place, Place>;

/// The edge or vertex of a hit triangle that the ray goes through.
std::optional<Border> find_border(const ShearedRay& ray, vec3 a, vec3 b, vec3 c) {
    const Edges e = exact_edges(project(ray, a), project(ray, b), project(ray, c));
    const vec3 corners[] = {a, b, c};
    const float opposite[] = {e.u, e.v, e.w};
    // A corner is on all edges but the opposite one.
    std::set<Place> border;
    for (int i = 0; i < 3; ++i)
        if (opposite[i] != 0) border.insert({corners[i].x, corners[i].y, corners[i].z});
    if (border.empty() || border.size() == 3) return std::nullopt;
    return Border{*border.begin(), *border.rbegin()};
}

/// The crossing of a point that doubles tell to be off the plane of the triangle, as that below.
std::optional<ExactCrossing> crossing_in_doubles(vec3 p, vec3 a, vec3 b, vec3 c) {
    const glm::dvec3 from(p);
    const glm::dvec3 ra = glm::dvec3(a) - from;
    const glm::dvec3 rb = glm::dvec3(b) - from;
    const glm::dvec3 rc = glm::dvec3(c) - from;
    const Sum u = edge_in_doubles(rb, rc);
    const Sum v = edge_in_doubles(rc, ra);
    const Sum w = edge_in_doubles(ra, rb);
    Sum height;
    height.add(ra.z, u.value, u.size);
    height.add(rb.z, v.value, v.size);
    height.add(rc.z, w.value, w.size);
    if (!u.has_sign() || !v.has_sign() || !w.has_sign() || !height.has_sign() || height.sign() == 0)
        return std::nullopt;
    const int side = moved_sign(u.sign(), b, c);
    const bool is_crossed = side != 0 && moved_sign(v.sign(), c, a) == side &&
                            moved_sign(w.sign(), a, b) == side && height.sign() == side;
    return ExactCrossing{is_crossed ? side : 0, false};
}

}  // namespace

ExactCrossing exact_crossing(vec3 p, vec3 a, vec3 b, vec3 c) {
    if (const auto crossing = crossing_in_doubles(p, a, b, c)) return *crossing;
    const WholeUnit unit(p, a, b, c);
    const WholeVector from = unit(p);
    const WholeVector ra = unit(a) - from;
    const WholeVector rb = unit(b) - from;
    const WholeVector rc = unit(c) - from;
    // Edge functions, opposite to a, b and c, in the planes of two axes.
    const WholeVector u = cross(rb, rc);
    const WholeVector v = cross(rc, ra);
    const WholeVector w = cross(ra, rb);
    int height = sgn(dot(u, ra));
    ExactCrossing crossing;
    // In the plane of the triangle, and not outside of it in any of three projections. Where the
    // triangle has no area its corners are on a line, and so is p then.
    crossing.is_on_triangle = height == 0 && is_in_box(p, a, b, c) &&
                              !any_opposite(u.x, v.x, w.x) && !any_opposite(u.y, v.y, w.y) &&
                              !any_opposite(u.z, v.z, w.z);
    const int side = moved_sign(sgn(u.z), b, c);
    if (side == 0 || moved_sign(sgn(v.z), c, a) != side || moved_sign(sgn(w.z), a, b) != side)
        return crossing;
    // The move changes the height by -(normal . move), and the normal's z has the sign `side`.
    if (height == 0) height = -sgn(u.x + v.x + w.x);
    if (height == 0) height = -sgn(u.y + v.y + w.y);
    if (height == 0) height = -side;
    if (height == side) crossing.sign = side;
    return crossing;
}

void keep_one_of_each_crossing(const Topology& topology, std::span<const vec3> positions,
                               std::span<const std::uint32_t> first_prims, const Ray& ray,
                               std::vector<Hit>& hits) {
    const ShearedRay sheared = shear_ray(ray.org, ray.dir);
    const auto mesh_of = [&](std::uint32_t prim_id) {
        return std::upper_bound(first_prims.begin(), first_prims.end(), prim_id) -
               first_prims.begin();
    };
    std::set<std::pair<std::ptrdiff_t, Border>> passed;
    std::erase_if(hits, [&](const Hit& hit) {
        if (!may_touch_border(hit.u, hit.v)) return false;
        const uvec3 t = topology.triangles[hit.prim_id];
        const auto border = find_border(sheared, positions[t.x], positions[t.y], positions[t.z]);
        return border && !passed.emplace(mesh_of(hit.prim_id), *border).second;
    });
}

}  // namespace mray
