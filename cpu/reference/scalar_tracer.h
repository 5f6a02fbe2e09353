// Single rays over the shared layout, in portable C++: the reference for tests of all faster
// tracers.
#pragma once

#include "common/bvh/bvh.h"
#include "common/interop/ray.h"

namespace mray::cpu {

/// Finds closest and any hits over a tree that outlives it. Threads may share one.
class ScalarTracer {
public:
    explicit ScalarTracer(const Bvh& bvh) : bvh_(&bvh) {}

    Hit intersect(const Ray& ray) const;
    bool occluded(const Ray& ray) const;

private:
    const Bvh* bvh_;
};

}  // namespace mray::cpu
