// The surfaces of a mesh.
#pragma once

#include <span>

#include "common/interop/surface.h"
#include "common/scene/mesh.h"

namespace mray::cpu {

/// The mesh that shading takes surfaces and albedos from.
struct ShadedMesh {
    const Topology* topology;
    std::span<const vec3> positions;

    Surface surface(const Ray& ray, const Hit& hit) const {
        const uvec3 t = topology->triangles[hit.prim_id];
        return surface_at(ray, hit, positions[t.x], positions[t.y], positions[t.z]);
    }
};

}  // namespace mray::cpu
