#include "common/scene/border_crossings.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <optional>
#include <set>
#include <utility>

#include "common/interop/tie_break_rule.h"

namespace mray {
namespace {

using Place = std::array<float, 3>;
/// The ends of an edge, the lower one first; or a vertex twice.
using Border = std::pair<Place, Place>;

Border border_of(vec3 a, vec3 b) { return std::minmax(Place{a.x, a.y, a.z}, Place{b.x, b.y, b.z}); }

/// The edge or vertex of a hit triangle that the ray goes through.
std::optional<Border> find_border(const ShearedRay& ray, vec3 a, vec3 b, vec3 c) {
    const Edges e = exact_edges(project(ray, a), project(ray, b), project(ray, c));
    const bool on_bc = e.u == 0;
    const bool on_ca = e.v == 0;
    const bool on_ab = e.w == 0;
    if (on_ca && on_ab) return border_of(a, a);
    if (on_ab && on_bc) return border_of(b, b);
    if (on_bc && on_ca) return border_of(c, c);
    if (on_bc) return border_of(b, c);
    if (on_ca) return border_of(c, a);
    if (on_ab) return border_of(a, b);
    return std::nullopt;
}

}  // namespace

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
        if (!may_touch_border({hit.t, hit.u, hit.v})) return false;
        const uvec3 t = topology.triangles[hit.prim_id];
        const auto border = find_border(sheared, positions[t.x], positions[t.y], positions[t.z]);
        return border && !passed.emplace(mesh_of(hit.prim_id), *border).second;
    });
}

}  // namespace mray
