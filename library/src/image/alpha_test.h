// Holes that textures make in the triangles of lit images.
#pragma once

#include <cstdint>

#include "library/src/image/image_conversion.h"
#include "library/src/image/sample_rays.h"

namespace morphray::detail {

/// Makes of an image that was traced as if there were no holes what a trace through them gives. A
/// hit in a hole is followed by the next hit of its ray, until one is none: camera rays first, then
/// shadow rays and rays of the sky where their number of occluded rays may have changed. Returns
/// the number of rays that this took. Throws what the backend throws, and Error(kCancelled).
std::uint64_t apply_alpha_test(const TracedScene& scene, TracedImage& image);

}  // namespace morphray::detail
