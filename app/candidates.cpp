#include "app/candidates.h"

#include <algorithm>

#include "common/interop/triangle.h"

namespace morphray::app {
namespace {

Candidate judge(const Ray& ray, const ShearedRay& sheared, const SlabRay& slab, vec3 a, vec3 b,
                vec3 c) {
    const vec3 pa = project(sheared, a);
    const vec3 pb = project(sheared, b);
    const vec3 pc = project(sheared, c);
    TriangleHit hit;
    hit_projected(sheared, ray.tnear, ray.tfar, pa, pb, pc, hit);
    Candidate result;
    result.t = hit.t;
    result.u = hit.u;
    result.v = hit.v;
    result.edge_u = difference_of_products(pb.x, pc.y, pb.y, pc.x);
    result.edge_v = difference_of_products(pc.x, pa.y, pc.y, pa.x);
    result.edge_w = difference_of_products(pa.x, pb.y, pa.y, pb.x);
    const float least = std::min({result.edge_u, result.edge_v, result.edge_w});
    const float most = std::max({result.edge_u, result.edge_v, result.edge_w});
    result.may_hit = may_hit_triangle(sheared, a, b, c);
    result.inside = least >= 0 || most <= 0;
    result.has_area = least != 0 || most != 0;
    result.in_range = hit.t > 0 && hit.t >= ray.tnear && hit.t <= ray.tfar;
    result.finite = finite_vertices(a, b, c);
    const vec3 lower(min(a.x, min(b.x, c.x)), min(a.y, min(b.y, c.y)), min(a.z, min(b.z, c.z)));
    const vec3 upper(max(a.x, max(b.x, c.x)), max(a.y, max(b.y, c.y)), max(a.z, max(b.z, c.z)));
    result.meets_box = hits_box(slab, lower, upper, result.t_enter) && result.t_enter <= result.t;
    result.is_hit = intersect_triangle(sheared, ray.tnear, ray.tfar, a, b, c, hit);
    return result;
}

bool before(const Candidate& a, const Candidate& b) {
    if (a.is_hit != b.is_hit) return a.is_hit;
    if (a.inside != b.inside) return a.inside;
    return wins(a.t, a.prim_id, b.t, b.prim_id);
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

}  // namespace morphray::app
