// Shadows on meshes with smooth normals.
#pragma once

#include <cstdint>
#include <span>

#include "library/image/image_conversion.h"
#include "library/image/sample_rays.h"

namespace morphray::detail {

/// Vertex normals by triangle, as in mray::VertexNormals.
struct SmoothCorners {
    std::span<const mray::uvec3> ids;
    std::span<const mray::vec3> normals;
};

/// Takes from an image of shadow rays those shadows that only the flatness of triangles makes. A
/// sample in shadow whose smooth normal faces the light is asked again from the smooth surface
/// above it (smooth_surface() of common/interop/lit.h), and is in the light if nothing lies between
/// the light and that point, nor between that point and the triangle. Returns the number of rays
/// that this took. Throws what the backend throws, and Error(kCancelled).
std::uint64_t light_smooth_surfaces(const TracedScene& scene, const SmoothCorners& corners,
                                    TracedImage& image);

}  // namespace morphray::detail
