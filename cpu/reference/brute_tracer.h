// Every ray against every triangle.
#pragma once

#include <span>

#include "common/interop/ray.h"
#include "common/scene/mesh.h"

namespace mray::cpu {

/// Finds closest and any hits over a mesh (positions in scene space) that outlives it. Threads may
/// share one.
class BruteTracer {
public:
    BruteTracer(const Topology& topology, std::span<const vec3> positions)
        : topology_(&topology), positions_(positions) {}

    Hit intersect(const Ray& ray) const;
    bool occluded(const Ray& ray) const;

private:
    const Topology* topology_;
    std::span<const vec3> positions_;
};

}  // namespace mray::cpu
