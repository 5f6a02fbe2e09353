#include "app/commands/candidates.h"

#include <algorithm>

#include "common/bvh/box.h"
#include "common/interop/hit_rule.h"
#include "common/scene/triangle_area.h"

namespace mray::app {
namespace {

Candidate judge(const Ray& ray, const ShearedRay& sheared, const SlabRay& slab, vec3 a, vec3 b,
                vec3 c) {
    const Edges edges = exact_edges(project(sheared, a), project(sheared, b), project(sheared, c));
    TriangleHit hit;
    const bool is_hit = intersect_triangle(sheared, ray.tnear, ray.tfar, a, b, c, hit);
    Candidate result;
    result.t = hit.t;
    result.u = hit.u;
    result.v = hit.v;
    result.edge_u = edges.u;
    result.edge_v = edges.v;
    result.edge_w = edges.w;
    result.may_hit = may_hit_triangle(sheared, a, b, c);
    result.inside = may_be_inside(edges);
    result.has_area = has_area(a, b, c);
    result.in_range = is_in_range(hit.t, ray.tnear, ray.tfar);
    result.finite = finite_vertices(a, b, c);
    Box bounds;
    for (const vec3 vertex : {a, b, c}) bounds.extend(vertex);
    const Box box = padded(bounds);
    result.meets_box = hits_box(slab, box.lower, box.upper, result.t_least) &&
                       result.t_least <= last_depth(result.t);
    result.is_hit = is_hit;
    return result;
}

bool before(const Candidate& a, const Candidate& b) {
    if (a.is_hit != b.is_hit) return a.is_hit;
    if (a.inside != b.inside) return a.inside;
    return is_closer(a.t, a.prim_id, b.t, b.prim_id);
}

}  // namespace

std::vector<Candidate> find_candidates(const Ray& ray, const Topology& topology,
                                       std::span<const vec3> positions, std::size_t limit,
                                       std::span<const std::uint32_t> wanted) {
    if (ray.dir == vec3(0, 0, 0)) return {};
    const ShearedRay sheared = shear_ray(ray.org, ray.dir);
    const SlabRay slab = slab_ray(ray.org, ray.dir);
    std::vector<Candidate> found;
    std::vector<Candidate> extra;
    for (std::uint32_t id = 0; id < topology.triangles.size(); ++id) {
        const uvec3 corners = topology.triangles[id];
        const vec3 a = positions[corners.x];
        const vec3 b = positions[corners.y];
        const vec3 c = positions[corners.z];
        const bool is_wanted = std::find(wanted.begin(), wanted.end(), id) != wanted.end();
        if (!is_wanted && !may_hit_triangle(sheared, a, b, c)) continue;
        Candidate candidate = judge(ray, sheared, slab, a, b, c);
        candidate.prim_id = id;
        (is_wanted ? extra : found).push_back(candidate);
    }
    std::sort(found.begin(), found.end(), before);
    if (found.size() > limit) found.resize(limit);
    found.insert(found.end(), extra.begin(), extra.end());
    std::sort(found.begin(), found.end(), before);
    return found;
}

}  // namespace mray::app
