#include "common/scene/mesh.h"

#include "common/base/hash.h"

namespace mray {

std::uint64_t topology_hash(const Topology& topology) {
    const std::uint32_t count[] = {topology.vertex_count};
    return Hasher()
        .add(std::span<const std::uint32_t>(count))
        .add(std::span(topology.triangles))
        .digest();
}

}  // namespace mray
