// From the camera that a user describes to the one that the tracers take.
#pragma once

#include <array>
#include <optional>

#include "common/interop/params.h"
#include "common/scene/scene_space.h"

namespace morphray {

using Point = std::array<double, 3>;

/// In world space. What is not given is chosen so that the bounds of the whole clip fill the
/// image, seen from slightly above its front (+z) right, and lit from above the eye's left.
struct ViewSpec {
    std::optional<Point> eye;
    std::optional<Point> target;
    Point up = {0, 1, 0};
    /// Vertical, in degrees.
    double fov = 45;
    std::optional<Point> light;
    std::uint32_t width = 1024;
    std::uint32_t height = 1024;
    std::uint32_t rays = kRaysPrimary;
    std::uint32_t ao_count = 16;
    /// Length of ambient-occlusion rays; 0: a quarter of the diagonal of the bounds.
    double ao_distance = 0;
};

/// The eye, target and light that a view ends up with, in world space.
struct ResolvedView {
    Point eye;
    Point target;
    Point light;
    double ao_distance = 0;
};
/// Never throws; what is not finite in the view stays so. Of empty bounds the scene is taken for a
/// cube with corners at distance 1 from 0, of a single point for one around it with corners as far
/// as 0 is. A target that is not given is the middle of the bounds, or for an eye just there a
/// point before it along -z.
ResolvedView resolve_view(const ViewSpec& view, const WorldBounds& bounds);

/// Throws Error(kBadInput) when eye and target coincide, up is parallel to the view, fov is not in
/// (0, 180) or too wide for the image's shape, a number is not finite, ao_distance is negative,
/// or the eye or light is farther than a million scene sizes; Error(kBadArgument) when width,
/// height or ao_count is 0; and Error(kLimit) above 65536 pixels a side or 2^28 in all, or 256 for
/// ao_count.
ImageParams make_image_params(const ViewSpec& view, const WorldBounds& bounds,
                              const SceneSpace& space);

}  // namespace morphray
