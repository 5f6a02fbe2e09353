#include "common/scene/mesh.h"

#include <algorithm>
#include <cmath>

#include "common/base/hash.h"
#include "common/interop/hit_rule.h"

namespace mray {
namespace {

Albedo channel(float value) {
    return static_cast<Albedo>(std::lround(std::clamp(value, 0.0f, 1.0f) * 255.0f));
}

/// Whether (e1 + r1) * (f2 + s2) - (e2 + r2) * (f1 + s1) is 0 because every product that a rounding
/// error r or s takes part in is 0 and the others cancel exactly.
bool products_cancel(float e1, float r1, float e2, float r2, float f1, float s1, float f2,
                     float s2) {
    return difference_of_products(e1, f2, e2, f1) == 0.0f && (r1 == 0.0f || f2 == 0.0f) &&
           (s2 == 0.0f || e1 == 0.0f) && (r2 == 0.0f || f1 == 0.0f) && (s1 == 0.0f || e2 == 0.0f);
}

}  // namespace

Albedo albedo_of(float r, float g, float b) {
    return channel(r) | channel(g) << 8 | channel(b) << 16;
}

std::uint64_t topology_hash(const Topology& topology) {
    const std::uint32_t count[] = {topology.vertex_count};
    return Hasher()
        .add(std::span<const std::uint32_t>(count))
        .add(std::span(topology.triangles))
        .digest();
}

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

bool has_area(vec3 a, vec3 b, vec3 c) {
    vec3 e = b - a;
    vec3 f = c - a;
    vec3 r = vec3(difference_error(b.x, a.x, e.x), difference_error(b.y, a.y, e.y),
                  difference_error(b.z, a.z, e.z));
    vec3 s = vec3(difference_error(c.x, a.x, f.x), difference_error(c.y, a.y, f.y),
                  difference_error(c.z, a.z, f.z));
    return !products_cancel(e.y, r.y, e.z, r.z, f.y, s.y, f.z, s.z) ||
           !products_cancel(e.z, r.z, e.x, r.x, f.z, s.z, f.x, s.x) ||
           !products_cancel(e.x, r.x, e.y, r.y, f.x, s.x, f.y, s.y);
}

}  // namespace mray
