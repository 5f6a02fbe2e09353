// Which triangles a ray may meet: a search that may name too many and never one too few.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "common/bvh/bvh.h"
#include "common/interop/ray.h"
#include "common/scene/mesh.h"

namespace morphray::accuracy {

using Double3 = std::array<double, 3>;

/// The largest magnitude of a component.
double largest_magnitude(vec3 v);

/// A tree's boxes met in double, each made larger by far more than double rounds. Knows nothing of
/// the tracers. Whatever floats the tree is made of, scene space or not.
class CandidateSearch {
public:
    /// The tree outlives it. Its boxes contain their triangles.
    explicit CandidateSearch(const Bvh& bvh);

    /// Triangles of the leaves whose boxes come within `margin` of the ray's line at t >= 0, in no
    /// order; `found` is emptied first. Threads may share one.
    void find(const Ray& ray, double margin, std::vector<std::uint32_t>& found) const;

private:
    const Bvh* bvh_;
    /// Of the largest coordinate: what the boxes are made larger by besides.
    double rounding_;
};

}  // namespace morphray::accuracy
