// Makes the parameters that tracers take from a description of the view.
#pragma once

#include <algorithm>
#include <cmath>
#include <optional>

#include <glm/geometric.hpp>

#include "common/interop/camera.h"
#include "common/interop/ray.h"
#include "common/scene/scene_space.h"

namespace mray {

using Point = std::array<double, 3>;

inline glm::dvec3 to_dvec3(const Point& p) { return {p[0], p[1], p[2]}; }
inline Point to_point(const glm::dvec3& v) { return {v.x, v.y, v.z}; }

/// The most pixels of an image, a side and in all.
inline constexpr std::uint32_t kMaxImageSide = 65536;
inline constexpr std::uint64_t kMaxPixels = std::uint64_t{1} << 28;

/// A calibrated camera in world space. A point at org + x * right + y * down + z * forward is seen
/// (fx * x / z + cx, fy * y / z + cy) pixels from the upper left corner of the image.
struct Pinhole {
    glm::dvec3 right = {0, 0, 0};
    glm::dvec3 down = {0, 0, 0};
    glm::dvec3 forward = {0, 0, 0};
    /// In floats, as the origin of a ray. (g++ 12 drops the rounding of doubles that stay doubles.)
    vec3 org = {0, 0, 0};
    double fx = 0;
    double fy = 0;
    double cx = 0;
    double cy = 0;

    bool operator==(const Pinhole&) const = default;
};

/// A view in world space. With the defaults the bounds of the whole animation span the image from
/// edge to edge with 2 % to spare, from the front (+z) right and above, lit from above the eye's
/// left. A given target stays in the middle of the image.
struct ViewSpec {
    std::optional<Point> eye = {};
    std::optional<Point> target = {};
    Point up = {0, 1, 0};
    /// Vertical, in degrees.
    double fov = 45;
    /// Takes the place of eye, target, up and fov.
    std::optional<Pinhole> pinhole = {};
    std::optional<Point> light = {};
    std::uint32_t width = 1024;
    std::uint32_t height = 1024;
    std::uint32_t rays = kRaysPrimary;
    std::uint32_t ao_count = 16;
    /// Length of ambient-occlusion rays; 0: a quarter of the diagonal of the bounds.
    double ao_distance = 0;

    bool operator==(const ViewSpec&) const = default;
};

struct ResolvedView {
    Point eye, target, light;
    double ao_distance = 0;
};
/// Returns the view with defaults filled in. Never throws; numbers that are not finite stay so.
/// Empty bounds count as a cube with corners at distance 1 from 0; a point counts as a cube around
/// it with corners as far from it as 0 is. The default target is beside the centre; for a given eye
/// the centre of the bounds, or, for an eye there, a point in direction -z from it.
ResolvedView resolve_view(const ViewSpec& view, const WorldBounds& bounds);

/// Gives a view without eye and target those that show an object, whose vertices these are, in the
/// middle of the image: from the front, right and above as `up` says, with room for its shadow on
/// a ground below it; and a light, unless it has one. Positions that are not finite do not count;
/// without any other, and for an `up` without direction, returns the view as it is.
ViewSpec frame_object(const ViewSpec& view, std::span<const vec3> positions);

/// Throws Error: kBadInput for a view that shows nothing or is not finite, or whose eye or light is
/// farther than a million scene sizes; kBadArgument for a size or ao_count of 0; kLimit above
/// kMaxImageSide, 2^28 pixels or an ao_count of 256.
ImageParams make_image_params(const ViewSpec& view, const WorldBounds& bounds,
                              const SceneSpace& space);

std::vector<Ray> camera_rays(const ImageParams& params);

// ---- Directions and axes of views

using glm::dvec3;

/// The sine of the angle between up and the view below which they count as parallel.
inline constexpr double kParallel = 1e-9;

inline bool all_finite(const dvec3& v) {
    return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

/// The unit vector in v's direction, or 0 for a vector without one. Any finite length will do.
inline dvec3 direction_of(dvec3 v) {
    const double largest = std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)});
    if (!(largest > 0) || !std::isfinite(largest)) return {0, 0, 0};
    // First by a power of two, so that no square overflows or vanishes.
    const int exponent = std::ilogb(largest);
    for (int axis = 0; axis < 3; ++axis) v[axis] = std::ldexp(v[axis], -exponent);
    return v / glm::length(v);
}

inline bool valid_fov(double fov) { return fov > 0 && fov < 180; }

/// Right, up and forward of a view, of length 1 and at right angles.
struct Axes {
    dvec3 right, up, forward;
};

/// right and up are 0 when up is parallel to the view or has no direction.
inline Axes axes_of(const dvec3& forward, const dvec3& up) {
    const dvec3 across = glm::cross(forward, direction_of(up));
    if (!(glm::length(across) > kParallel)) return {{0, 0, 0}, {0, 0, 0}, forward};
    const dvec3 right = across / glm::length(across);
    return {right, glm::cross(right, forward), forward};
}

}  // namespace mray
