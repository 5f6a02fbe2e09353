// Intersection rules from the literature in float, each as its authors give it. All have the
// traversal of our scalar tracer with padded slabs, so that methods differ in the rule.
#pragma once

#include <span>

#include "common/bvh/bvh.h"
#include "common/interop/ray.h"

namespace mray::lab {

/// T. Moeller, B. Trumbore. Fast, Minimum Storage Ray/Triangle Intersection. 1997.
void trace_by_moeller_trumbore(const Bvh& bvh, std::span<const Ray> rays, std::span<Hit> hits);

/// S. Woop, C. Benthin, I. Wald. Watertight Ray/Triangle Intersection. 2013.
void trace_by_woop(const Bvh& bvh, std::span<const Ray> rays, std::span<Hit> hits);

}  // namespace mray::lab
