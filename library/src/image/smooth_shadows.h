// Shadows on meshes with smooth normals.
#pragma once

#include <cstdint>
#include <span>

#include "cpu/image/lit_shader.h"
#include "library/src/image/sample_rays.h"

namespace morphray::detail {

/// Takes from an image of shadow rays those shadows that only the flatness of triangles makes. A
/// sample in shadow whose smooth normal faces the light is asked again from the smooth surface
/// above it (smooth_surface() of common/interop/lit.h), and is in the light if nothing lies between
/// the light and that point, nor between that point and the triangle. Returns the number of rays
/// that this took. `shadows` are those of `samples`, which have normal_ids. Throws what the backend
/// throws, and Error(kCancelled).
std::uint64_t light_smooth_surfaces(const TracedScene& scene, const mray::cpu::LitShader& shader,
                                    const mray::cpu::LitSamples& samples,
                                    std::span<std::uint32_t> shadows);

}  // namespace morphray::detail
