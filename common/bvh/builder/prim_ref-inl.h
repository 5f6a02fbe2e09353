// Loops over refs, compiled once for each target.
#if defined(MORPHRAY_COMMON_BVH_BUILDER_PRIM_REF_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef MORPHRAY_COMMON_BVH_BUILDER_PRIM_REF_INL_H
#undef MORPHRAY_COMMON_BVH_BUILDER_PRIM_REF_INL_H
#else
#define MORPHRAY_COMMON_BVH_BUILDER_PRIM_REF_INL_H
#endif

#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>

#include "common/bvh/builder/prim_ref.h"
#include "common/simd/fixed_vectors-inl.h"

HWY_BEFORE_NAMESPACE();
namespace mray {
namespace HWY_NAMESPACE {
using namespace simd::HWY_NAMESPACE;

/// The first three lanes of each.
HWY_INLINE Box box_of(Float4 lower, Float4 upper) {
    alignas(16) float l[4];
    alignas(16) float u[4];
    store(lower, l);
    store(upper, u);
    return {{l[0], l[1], l[2]}, {u[0], u[1], u[2]}};
}

/// A register whose first three lanes are a vertex.
HWY_INLINE Float4 load_vertex(std::span<const vec3> positions, std::uint32_t vertex) {
    // Nothing may follow the last vertex in memory.
    if (vertex == positions.size() - 1) [[unlikely]] {
        const vec3 p = positions[vertex];
        alignas(16) const float lanes[4] = {p.x, p.y, p.z, 0};
        return load4(lanes);
    }
    return load4_unaligned(&positions[vertex].x);
}

inline void make_refs(const Topology& topology, std::span<const vec3> positions,
                      std::uint32_t first, std::span<PrimRef> refs) {
    for (std::size_t i = 0; i < refs.size(); ++i) {
        const auto prim_id = first + static_cast<std::uint32_t>(i);
        const uvec3 t = topology.triangles[prim_id];
        Float4 lower = splat4(kEmptyPlane);
        Float4 upper = splat4(-kEmptyPlane);
        for (const std::uint32_t vertex : {t.x, t.y, t.z}) {
            if (!is_finite_vertex(positions[vertex])) [[unlikely]]
                continue;
            const Float4 p = load_vertex(positions, vertex);
            lower = min(lower, p);
            upper = max(upper, p);
        }
        float* const planes = refs[i].planes;
        store(lower, planes);
        store(-upper, planes + 4);
        planes[3] = std::bit_cast<float>(PrimRef::kIdBits | prim_id);
        planes[7] = 0;
    }
}

inline Box union_of(std::span<const PrimRef> refs) {
    Float8 planes = splat8(kEmptyPlane);
    for (const PrimRef& ref : refs) planes = min(planes, load8(ref.planes));
    return box_of(low_half(planes), -high_half(planes));
}

inline Box bound_centroids(std::span<const PrimRef> refs) {
    // Two of each, so that neither waits for the other.
    Float4 lower[2] = {splat4(kEmptyPlane), splat4(kEmptyPlane)};
    Float4 upper[2] = {splat4(-kEmptyPlane), splat4(-kEmptyPlane)};
    const auto add = [&](std::size_t i) HWY_ATTR {
        const PrimRef& ref = refs[i];
        if (ref.empty()) return;
        const Float4 centroid2 = load4(ref.planes) - load4(ref.planes + 4);
        lower[i % 2] = min(lower[i % 2], centroid2);
        upper[i % 2] = max(upper[i % 2], centroid2);
    };
    for (std::size_t i = 0; i + 1 < refs.size(); i += 2) {
        add(i);
        add(i + 1);
    }
    if (refs.size() % 2 != 0) add(refs.size() - 1);
    return box_of(min(lower[0], lower[1]), max(upper[0], upper[1]));
}

}  // namespace HWY_NAMESPACE
}  // namespace mray
HWY_AFTER_NAMESPACE();

#endif  // per target
