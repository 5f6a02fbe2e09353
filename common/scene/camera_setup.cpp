#include "common/scene/camera_setup.h"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numbers>

#include "common/base/errors.h"
#include "common/interop/camera.h"
#include "common/scene/view_axes.h"

namespace mray {
namespace {

// A pixel's ambient-occlusion rays (common/interop/params.h).
constexpr std::uint32_t kMaxAoCount = 256;
// Directions may be up to 2^42 (common/interop/ray.h); the image's corner is the largest.
constexpr double kMaxSlope = 0x1p40;
// Smaller components of a direction change no pixel's ray and would make denormal products.
constexpr double kNegligible = 0x1p-60;

// Throws an error with this text unless the view is as it must be.
template <class... Values>
void require(bool holds, ErrorKind kind, fmt::format_string<Values...> text, Values... values) {
    if (!holds) throw Error(kind, fmt::vformat(text, fmt::make_format_args(values...)));
}

void require_finite(const dvec3& v, const char* what) {
    require(all_finite(v), ErrorKind::kBadInput,
            "the {} ({}, {}, {}) is not finite; give three finite numbers", what, v.x, v.y, v.z);
}

void check_size(const ViewSpec& view) {
    require(view.width > 0 && view.height > 0 && view.ao_count > 0, ErrorKind::kBadArgument,
            "an image of {} x {} pixels with {} ambient-occlusion rays each is asked for; each "
            "number must be at least 1",
            view.width, view.height, view.ao_count);
    const std::uint64_t pixels = std::uint64_t{view.width} * view.height;
    require(view.width <= kMaxImageSide && view.height <= kMaxImageSide && pixels <= kMaxPixels,
            ErrorKind::kLimit,
            "an image of {} x {} pixels is too large; at most {} a side and {} in all are possible",
            view.width, view.height, kMaxImageSide, kMaxPixels);
    require(view.ao_count <= kMaxAoCount, ErrorKind::kLimit,
            "{} ambient-occlusion rays a pixel are too many; at most {} are possible",
            view.ao_count, kMaxAoCount);
}

void check_view(const ViewSpec& view, const ResolvedView& resolved) {
    require_finite(to_dvec3(resolved.eye), "eye");
    require_finite(to_dvec3(resolved.target), "target");
    require_finite(to_dvec3(view.up), "up vector");
    require_finite(to_dvec3(resolved.light), "light");
    require(valid_fov(view.fov), ErrorKind::kBadInput,
            "a field of view of {} degrees is impossible; give one above 0 and below 180",
            view.fov);
    require(resolved.ao_distance > 0 && std::isfinite(resolved.ao_distance), ErrorKind::kBadInput,
            "an ambient-occlusion distance of {} is impossible; give a finite one that is not "
            "negative",
            view.ao_distance);
}

Axes checked_axes(const ViewSpec& view, const ResolvedView& resolved) {
    const Point& eye = resolved.eye;
    const dvec3 forward = direction_of(to_dvec3(resolved.target) - to_dvec3(eye));
    require(forward != dvec3(0, 0, 0), ErrorKind::kBadInput,
            "eye and target are both ({}, {}, {}); move one of them", eye[0], eye[1], eye[2]);
    const Axes axes = axes_of(forward, to_dvec3(view.up));
    require(axes.right != dvec3(0, 0, 0), ErrorKind::kBadInput,
            "the up vector ({}, {}, {}) is parallel to the view; give another", view.up[0],
            view.up[1], view.up[2]);
    return axes;
}

vec3 to_direction(const dvec3& v) {
    vec3 direction;
    for (int axis = 0; axis < 3; ++axis) {
        direction[axis] = std::abs(v[axis]) < kNegligible ? 0.0f : static_cast<float>(v[axis]);
    }
    return direction;
}

Camera make_camera(const ViewSpec& view, const Axes& axes, const vec3& org) {
    const double half_height = std::tan(view.fov * (std::numbers::pi / 360));
    const double half_width = half_height * view.width / view.height;
    require(std::max(half_width, half_height) <= kMaxSlope, ErrorKind::kBadInput,
            "a field of view of {} degrees is too wide for an image of {} x {} pixels; give a "
            "smaller one",
            view.fov, view.width, view.height);
    const double pixel = 2 * half_height / view.height;
    Camera camera = {};
    camera.org = org;
    camera.corner = to_direction(axes.forward - half_width * axes.right + half_height * axes.up);
    camera.du = to_direction(pixel * axes.right);
    camera.dv = to_direction(-pixel * axes.up);
    return camera;
}

}  // namespace

ImageParams make_image_params(const ViewSpec& view, const WorldBounds& bounds,
                              const SceneSpace& space) {
    assert(view.rays <= kRaysAo);
    check_size(view);
    const ResolvedView resolved = resolve_view(view, bounds);
    check_view(view, resolved);
    const Axes axes = checked_axes(view, resolved);
    const vec3 org = space.point_to_scene(to_dvec3(resolved.eye), "the eye");

    ImageParams params = {};
    params.camera = make_camera(view, axes, org);
    params.light = space.point_to_scene(to_dvec3(resolved.light), "the light");
    params.ao_tfar = static_cast<float>(
        std::clamp(space.length_to_scene(resolved.ao_distance), 0x1p-100, double(kInfiniteT)));
    params.width = view.width;
    params.height = view.height;
    params.rays = view.rays;
    params.ao_count = view.ao_count;
    return params;
}

std::vector<Ray> camera_rays(const ImageParams& params) {
    std::vector<Ray> rays;
    rays.reserve(std::size_t{params.width} * params.height);
    for (std::uint32_t y = 0; y < params.height; ++y) {
        for (std::uint32_t x = 0; x < params.width; ++x)
            rays.push_back(camera_ray(params.camera, x, y));
    }
    return rays;
}

}  // namespace mray
