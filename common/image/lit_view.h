// What lit images and false colours are made of, besides a scene and the hits of their samples.
#pragma once

#include <array>
#include <cstdint>

#include "common/interop/shading.h"
#include "common/scene/vertex_normals.h"

namespace mray {

/// kPlain: each sample has the colour of an ordinary image.
enum class LitKind : std::uint32_t { kPlain, kLit, kNormal, kDepth, kPrim };
static_assert(kLitPrim == static_cast<std::uint32_t>(LitKind::kPrim), "as in shading.h");

/// A view, whose pixels have side * side samples each; the camera, width and height of `params` are
/// those of the samples.
struct LitView {
    ImageParams params;
    std::uint32_t side;
    LitKind kind;
    vec3 up;
    /// For kDepth, as in depth_colour().
    float near;
    float per_depth;
    /// For kLit: a sample's ambient-occlusion rays; 0: none.
    std::uint32_t ao_count;
    /// Null: triangles are flat.
    const VertexNormals* normals;
};

/// Red, green and blue, linear, the mean of a pixel's samples.
using LinearColour = std::array<float, 3>;

}  // namespace mray
