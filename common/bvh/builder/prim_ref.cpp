#include "common/bvh/builder/prim_ref.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "common/bvh/builder/prim_ref.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "common/bvh/builder/prim_ref-inl.h"

#if HWY_ONCE

#include "common/simd/simd_dispatch-inl.h"

namespace mray {
namespace {

HWY_EXPORT(make_refs);
HWY_EXPORT(union_of);
HWY_EXPORT(bound_centroids);

}  // namespace

PrimRef make_ref(const Topology& topology, std::span<const vec3> positions, std::uint32_t prim_id) {
    const uvec3 t = topology.triangles[prim_id];
    Box box;
    for (const std::uint32_t vertex : {t.x, t.y, t.z}) {
        if (is_finite_vertex(positions[vertex])) box.extend(positions[vertex]);
    }
    return {box, prim_id};
}

void make_refs(const Topology& topology, std::span<const vec3> positions, std::uint32_t first,
               std::span<PrimRef> refs, const SimdTarget& target) {
    SIMD_FUNCTION(make_refs, target)(topology, positions, first, refs);
}

Box union_of(std::span<const PrimRef> refs, const SimdTarget& target) {
    return SIMD_FUNCTION(union_of, target)(refs);
}

Box centroid_bounds(std::span<const PrimRef> refs, const SimdTarget& target) {
    return SIMD_FUNCTION(bound_centroids, target)(refs);
}

}  // namespace mray

#endif  // HWY_ONCE
