#include "common/scene/mesh.h"

#include <algorithm>
#include <cmath>

#include "common/base/hash.h"

namespace mray {
namespace {

Albedo channel(float value) {
    return static_cast<Albedo>(std::lround(std::clamp(value, 0.0f, 1.0f) * 255.0f));
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

}  // namespace mray
