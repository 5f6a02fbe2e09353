// Lit images and false colours, from the hits of camera rays, with SIMD.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/image/lit_view.h"
#include "common/interop/ray.h"
#include "common/scene/mesh.h"
#include "common/simd/simd_target.h"
#include "cpu/image/texture.h"

namespace mray::cpu {

/// The traced samples of an image and what their shading needs. Arrays have one entry a sample, row
/// by row.
struct LitSamples {
    const LitView& view;
    const Topology& topology;
    std::span<const vec3> positions;
    /// The textures of the triangles whose albedo has kTexturedBit.
    TexturedTriangles textures = {};

    std::span<const Hit> hits;
    /// For kLit: 1 where the light does not reach the hit, else 0.
    std::span<const std::uint32_t> shadows;
    /// How many of a sample's view.ao_count ambient-occlusion rays are occluded.
    std::span<const std::uint32_t> occlusion;
    /// For kPlain: the colours.
    std::span<const std::uint32_t> colours;
};

/// Shades images with the bits of common/interop/shading.h. The occlusion of a sample is the mean
/// over the square of kAoSquareSide samples a side around it, without those on other surfaces (A.
/// Keller, W. Heidrich. Interleaved sampling. 2001). The samples of a pixel are averaged as linear
/// colours.
struct LitShader {
    explicit LitShader(SimdTarget target);

    /// Writes rows [begin, end) of the image, of view.params.width / side pixels each, to `pixels`,
    /// which points to row `begin`. With kLit, and unless null, `linear` gets the same rows.
    /// Threads may write rows of the same image at the same time.
    void (*shade_rows)(const LitSamples& samples, std::uint32_t begin, std::uint32_t end,
                       std::uint32_t* pixels, LinearColour* linear);

    /// Sets `xs` to the samples x of row y in shadow whose smooth surface (smooth_surface() of
    /// common/interop/shading.h) faces the light and is another than the flat one, in order. The
    /// samples have view.normals and `shadows`. Thread-safe.
    void (*find_flat_shadows)(const LitSamples& samples, std::uint32_t y,
                              std::vector<std::uint32_t>& xs);
};

}  // namespace mray::cpu
