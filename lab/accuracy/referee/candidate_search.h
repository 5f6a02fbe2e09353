// Finds the triangles that a ray may meet; may find too many and never misses one.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "common/bvh/bvh.h"
#include "common/interop/ray.h"
#include "common/scene/mesh.h"

namespace mray::accuracy {

using Double3 = std::array<double, 3>;

/// The largest magnitude of a component.
double largest_magnitude(vec3 v);

/// Tests the boxes of a tree in double, enlarged by far more than the rounding errors. Shares no
/// code with the tracers. Takes trees in any space.
class CandidateSearch {
public:
    /// The tree outlives the search; its boxes contain their triangles.
    explicit CandidateSearch(const Bvh& bvh);

    /// Triangles of the leaves whose boxes come within `margin` of the ray's line at t >= 0, in any
    /// order. Replaces the content of `found`. Thread-safe.
    void find(const Ray& ray, double margin, std::vector<std::uint32_t>& found) const;

private:
    const Bvh* bvh_;
    /// By how much boxes are enlarged for rounding, from the largest coordinate.
    double rounding_;
};

}  // namespace mray::accuracy
