// The places of vertices under the joints of a skin.
#pragma once

#include <cstddef>
#include <cstdint>

#include "common/interop/platform.h"
#include "common/simd/simd_target.h"

namespace mray::gltf {

/// The columns of an affine map; the fourth row is 0, 0, 0, 1.
struct alignas(32) Columns {
    double column[4][4];
};

/// Vertices with `per_vertex` joints and weights each.
struct SkinnedVertices {
    /// The maps of the skin's joints, which `joints` are indices of.
    const Columns* maps;
    std::size_t per_vertex;
    const std::uint16_t* joints;
    const float* weights;
    /// The position of each vertex; not used if there are morphed ones.
    const vec3* positions;
    /// x, y, z of each after morph targets; null without these.
    const double* morphed;
    std::size_t count;
};

/// Writes the places of all vertices.
using PlaceSkinned = void (*)(const SkinnedVertices& vertices, vec3* out);

/// The function for a target. All give the same bits.
PlaceSkinned place_skinned_on(const SimdTarget& target);

}  // namespace mray::gltf
