// Single rays over the shared layout with SIMD across the 16 children of a node and the 16
// triangles of a leaf: for incoherent rays.
#pragma once

#include <cstdint>
#include <span>

#include "common/bvh/bvh.h"
#include "common/interop/ray.h"
#include "common/simd/simd_target.h"

namespace mray::cpu {

/// Finds closest and any hits over a tree that outlives it, with the bits of ScalarTracer. Threads
/// may share one.
class SingleRayTracer {
public:
    SingleRayTracer(const Bvh& bvh, SimdTarget target);

    /// hits[i] answers rays[i]; as many of both.
    void intersect(std::span<const Ray> rays, std::span<Hit> hits) const {
        intersect_(*bvh_, rays, hits);
    }
    /// occluded[i] is 1 if rays[i] hits anything, else 0; as many of both.
    void occluded(std::span<const Ray> rays, std::span<std::uint8_t> occluded) const {
        occluded_(*bvh_, rays, occluded);
    }

private:
    const Bvh* bvh_;
    void (*intersect_)(const Bvh&, std::span<const Ray>, std::span<Hit>);
    void (*occluded_)(const Bvh&, std::span<const Ray>, std::span<std::uint8_t>);
};

}  // namespace mray::cpu
