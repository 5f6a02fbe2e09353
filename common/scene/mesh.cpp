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

/// In units of the grid of coordinates, 2^-40.
std::int64_t on_grid(float x) { return static_cast<std::int64_t>(std::ldexp(x, 40)); }

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
    if (!finite_vertices(a, b, c)) return false;
    __extension__ typedef __int128 Wide;
    const auto edge = [&](vec3 to, int axis) { return Wide{on_grid(to[axis]) - on_grid(a[axis])}; };
    const auto is_turned = [&](int i, int j) {
        return edge(b, i) * edge(c, j) != edge(b, j) * edge(c, i);
    };
    return is_turned(0, 1) || is_turned(1, 2) || is_turned(2, 0);
}

}  // namespace mray
