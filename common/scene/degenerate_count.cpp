#include "common/scene/degenerate_count.h"

#include "common/interop/hit_rule.h"
#include "common/scene/triangle_area.h"

namespace mray {

DegenerateCount count_degenerate(const Topology& topology, std::span<const vec3> positions) {
    DegenerateCount count;
    for (const uvec3& t : topology.triangles) {
        const vec3 a = positions[t.x];
        const vec3 b = positions[t.y];
        const vec3 c = positions[t.z];
        if (!finite_vertices(a, b, c)) {
            ++count.not_finite;
            continue;
        }
        if (!has_area(a, b, c)) ++count.zero_area;
    }
    return count;
}

}  // namespace mray
