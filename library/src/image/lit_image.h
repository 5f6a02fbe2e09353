// Images of several samples a pixel, lit or in false colours.
#pragma once

#include <cstdint>
#include <span>

#include "common/base/watch.h"
#include "common/scene/camera_setup.h"
#include "library/src/scene_impl.h"
#include "morphray/image.hpp"

namespace morphray::detail {

mray::ViewSpec to_spec(const View& view);

/// Traces and shades a view at the pose; the scene's mutex is locked. Shades on the CPU what any
/// backend has traced, so that colours do not depend on the backend. Fills pixels, lit_pixels,
/// ray_count, trace_ms and shade_ms of the image. Throws what make_image_params() and the backend
/// throw; Error(bad_argument) for other numbers of samples than View::samples allows.
void render_lit(SceneImpl& scene, const View& view, const mray::Watch& watch, TracedImage& traced,
                Image& image);

// The passes of render_lit() that trace rays. Both return the number of rays that they took. They
// throw what the backend throws, and Error(kCancelled).

/// Makes of an image that was traced as if there were no holes what a trace through them gives. A
/// hit in a hole is followed by the next hit of its ray, until one is none: camera rays first, then
/// shadow rays and rays of the sky where their number of occluded rays may have changed.
std::uint64_t apply_alpha_test(SceneImpl& scene, const mray::Watch& watch, TracedImage& image);

/// Takes from an image of shadow rays those shadows that only the flatness of triangles makes. A
/// sample in shadow whose smooth normal faces the light is asked again from the smooth surface
/// above it (smooth_surface() of common/interop/lit.h), and is in the light if nothing lies between
/// the light and that point, nor between that point and the triangle. `shadows` are those of
/// `samples`, which have normal_ids.
std::uint64_t light_smooth_surfaces(SceneImpl& scene, const mray::Watch& watch,
                                    const mray::cpu::LitSamples& samples,
                                    std::span<std::uint32_t> shadows);

}  // namespace morphray::detail
