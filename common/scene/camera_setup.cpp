#include "common/scene/camera_setup.h"

#include <cassert>
#include <numbers>

#include <glm/common.hpp>

#include "common/base/errors.h"

namespace mray {
namespace {

// A pixel's ambient-occlusion rays (common/interop/camera.h).
constexpr std::uint32_t kMaxAoCount = 256;
// Directions may be up to 2^42 (common/interop/ray.h); the image's corner is the largest.
constexpr double kMaxSlope = 0x1p40;
// Smaller components of a direction change no pixel's ray and would make denormal products.
constexpr double kNegligible = 0x1p-60;

template <class... Values>
void require(bool holds, ErrorKind kind, fmt::format_string<Values...> text, Values&&... values) {
    if (!holds) throw Error(kind, text, std::forward<Values>(values)...);
}

void require_finite(const dvec3& v, const char* what) {
    require(all_finite(v), ErrorKind::kBadInput,
            "the {} ({}, {}, {}) is not finite; give three finite numbers", what, v.x, v.y, v.z);
}

void check_size(const ViewSpec& view) {
    require(view.width > 0 && view.height > 0, ErrorKind::kBadArgument,
            "an image of {} x {} pixels is asked for; each number must be at least 1", view.width,
            view.height);
    require(view.ao_count > 0, ErrorKind::kBadArgument,
            "0 ambient-occlusion rays a pixel are asked for; at least 1 is needed");
    const std::uint64_t pixels = std::uint64_t{view.width} * view.height;
    require(view.width <= kMaxImageSide && view.height <= kMaxImageSide && pixels <= kMaxPixels,
            ErrorKind::kLimit,
            "{} x {} samples are too many; give a smaller image, at most {} a side and {} in all",
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
    for (int axis = 0; axis < 3; ++axis)
        direction[axis] = std::abs(v[axis]) < kNegligible ? 0.0f : static_cast<float>(v[axis]);
    return direction;
}

Camera camera_of(const vec3& org, const dvec3& corner, const dvec3& du, const dvec3& dv) {
    return {org, 0, to_direction(corner), 0, to_direction(du), 0, to_direction(dv), 0};
}

Camera make_camera(const ViewSpec& view, const Axes& axes, const vec3& org) {
    const double half_height = std::tan(view.fov * (std::numbers::pi / 360));
    const double half_width = half_height * view.width / view.height;
    require(std::max(half_width, half_height) <= kMaxSlope, ErrorKind::kBadInput,
            "a field of view of {} degrees is too wide for an image of {} x {} pixels; give a "
            "smaller one",
            view.fov, view.width, view.height);
    const double pixel = 2 * half_height / view.height;
    return camera_of(org, axes.forward - half_width * axes.right + half_height * axes.up,
                     pixel * axes.right, -pixel * axes.up);
}

/// Throws Error(kBadInput) for a matrix that is no rotation, and for impossible intrinsics.
void check_pinhole(const ViewSpec& view, const Pinhole& pinhole) {
    constexpr double kMostError = 1e-3;
    const auto& [right, down, forward, org, fx, fy, cx, cy] = pinhole;
    double error = glm::length(glm::cross(right, down) - forward);
    for (const dvec3& axis : {right, down, forward})
        error = std::max(error, std::abs(glm::length(axis) - 1));
    // False for NaN, too.
    require(error <= kMostError, ErrorKind::kBadInput,
            "the axes of a camera, such as ({}, {}, {}), are not those of a rotation; give unit "
            "vectors at right angles, right-handed",
            right.x, right.y, right.z);
    const double slope = std::max({std::abs(cx / fx), std::abs((view.width - cx) / fx),
                                   std::abs(cy / fy), std::abs((view.height - cy) / fy)});
    require(fx > 0 && fy > 0 && std::isfinite(fx + fy + cx + cy) && slope <= kMaxSlope,
            ErrorKind::kBadInput,
            "focal lengths ({}, {}) and a principal point ({}, {}) are impossible for an image of "
            "{} x {} pixels; give positive and finite lengths, in pixels",
            fx, fy, cx, cy, view.width, view.height);
}

/// In doubles, of which each is rounded once: as docs/guide/sensors.md shows it in numpy.
Camera make_pinhole_camera(const Pinhole& pinhole, const vec3& org) {
    const dvec3 du = pinhole.right / pinhole.fx;
    const dvec3 dv = pinhole.down / pinhole.fy;
    return camera_of(org, (pinhole.forward - pinhole.cx * du) - pinhole.cy * dv, du, dv);
}

// Where the eye is, seen from the target, unless it is given: in front, to the right, above.
const dvec3 kDefaultSide(0.45, 0.4, 1);
// The image is larger than the scene in it by this factor.
constexpr double kFramingMargin = 1.02;
// The image is larger than an object by this factor. Its shadow has kFramingMargin.
constexpr double kObjectMargin = 1.15;
// The light is above, by these parts to the left and in front: shadows fall behind. In radii.
constexpr double kLightLeft = 0.4;
constexpr double kLightFront = 0.8;
constexpr double kLightDistance = 8;
// The least depth of the scene before the eye, as a part of its radius: fields of view that are
// nearly 180 degrees would put the eye into the nearest corner.
constexpr double kLeastDepth = 0.05;

struct SceneBox {
    dvec3 centre = {0, 0, 0};
    dvec3 half = dvec3(1, 1, 1) / std::sqrt(3.0);
    double radius() const { return std::hypot(half.x, half.y, half.z); }
};

// A point has its distance from 0 for a size, as in SceneSpace; nothing and 0 alone have 1.
SceneBox scene_box(const WorldBounds& bounds) {
    SceneBox unit;
    if (bounds.empty()) return unit;
    SceneBox box{bounds.lower / 2.0 + bounds.upper / 2.0, bounds.upper / 2.0 - bounds.lower / 2.0};
    if (box.radius() == 0) {
        const double size = std::hypot(box.centre.x, box.centre.y, box.centre.z);
        box.half = unit.half * (size > 0 ? size : 1);
    }
    return box;
}

// The slopes from the middle of the image to the upper and the right end of the scene.
struct HalfSlopes {
    double up, right;
};

HalfSlopes framing_slopes(const ViewSpec& view) {
    const double fov = valid_fov(view.fov) ? view.fov : ViewSpec{}.fov;
    const double up = std::tan(fov * (std::numbers::pi / 360)) / kFramingMargin;
    const bool is_sized = view.width > 0 && view.height > 0;
    return {up, is_sized ? up * view.width / view.height : up};
}

std::array<dvec3, 8> corners_of(const SceneBox& scene) {
    std::array<dvec3, 8> corners;
    for (int i = 0; i < 8; ++i) {
        const dvec3 sign((i & 1) * 2 - 1, (i & 2) - 1, (i & 4) / 2 - 1);
        corners[static_cast<std::size_t>(i)] = scene.centre + sign * scene.half;
    }
    return corners;
}

// How far before the target the eye must be for all points to be in the image with a margin, and at
// least least_depth before the eye.
template <class Points>
double framing_distance(const HalfSlopes& slopes, const Axes& axes, double least_depth,
                        const Points& points, const dvec3& target, double margin) {
    double distance = 0;
    for (const auto& point : points) {
        const dvec3 p = dvec3(point) - target;
        const double least = std::max(std::abs(glm::dot(p, axes.up)) / slopes.up,
                                      std::abs(glm::dot(p, axes.right)) / slopes.right);
        const double depth = margin * std::max(least, least_depth);
        distance = std::max(distance, depth - glm::dot(p, axes.forward));
    }
    return distance;
}

// Returns the point, at the depth of the box's middle, that the eye looks at from the least
// distance at which all corners are in the image: the middle, or the point nearest to it that
// allows that.
// 1. Let x and z be the place of a corner along an axis of the image and forward, both from the
//    middle, s the slope on that axis, and e and -d the place of the eye.
// 2. The corner is in the image if x - e and e - x are at most s (z + d).
// 3. So e is at least a - s d and at most s d - b, where a is the largest x - s z of all corners,
//    and b the largest -x - s z.
// 4. There is such an e if 2 s d is at least a + b.
dvec3 framing_target(const HalfSlopes& slopes, const Axes& axes, const SceneBox& scene) {
    struct Axis {
        dvec3 across;
        double slope;
        double a = -std::numeric_limits<double>::infinity();
        double b = a;
    };
    Axis both[] = {{axes.right, slopes.right}, {axes.up, slopes.up}};
    double distance = 0;
    for (Axis& axis : both) {
        for (const dvec3& corner : corners_of(scene)) {
            const dvec3 p = corner - scene.centre;
            const double x = glm::dot(p, axis.across);
            const double z = axis.slope * glm::dot(p, axes.forward);
            axis.a = std::max(axis.a, x - z);
            axis.b = std::max(axis.b, -x - z);
        }
        distance = std::max(distance, (axis.a + axis.b) / (2 * axis.slope));
    }
    dvec3 target = scene.centre;
    for (const Axis& axis : both) {
        const double room = axis.slope * distance;
        target += std::max(axis.a - room, std::min(0.0, room - axis.b)) * axis.across;
    }
    return target;
}

// Above left of the eye by its distance from the middle, farther if that is in the scene.
dvec3 default_light(const dvec3& eye, const Axes& axes, const SceneBox& scene) {
    const dvec3 aside = 0.7 * axes.up - 0.6 * axes.right;
    const double radius = scene.radius();
    double reach = std::max(glm::length(eye - scene.centre), 2 * radius);
    // A line leaves a sphere of 1.5 radii within a few doublings; an invalid view has no axes.
    for (int i = 0; i < 4; ++i) {
        if (glm::length(eye + reach * aside - scene.centre) > 1.5 * radius) break;
        reach *= 2;
    }
    return eye + reach * aside;
}

// Returns kDefaultSide, turned by the least angle that brings the y axis to `up`.
dvec3 default_side(const dvec3& up) {
    if (up.y < kParallel - 1) return {kDefaultSide.x, -kDefaultSide.y, -kDefaultSide.z};
    const dvec3 axis = glm::cross(dvec3(0, 1, 0), up);
    const dvec3 turned = glm::cross(axis, kDefaultSide);
    return kDefaultSide + turned + glm::cross(axis, turned) / (1 + up.y);
}

// Vertices of an object and their shadows, in radii from its middle to the right, up and forward.
struct SeenObject {
    std::vector<vec3> vertices, shadows;

    double distance(const HalfSlopes& slopes, const dvec3& target) const {
        const Axes axes = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
        return std::max(framing_distance(slopes, axes, kLeastDepth, vertices, target,
                                         kObjectMargin / kFramingMargin),
                        framing_distance(slopes, axes, kLeastDepth, shadows, target, 1));
    }
};

// `light` is in radii from the middle. The shadows are on the plane through the lowest vertex.
SeenObject see_object(std::span<const vec3> positions, const SceneBox& box, const Axes& axes,
                      const dvec3& up, const dvec3& light) {
    const auto seen = [&](const dvec3& p) {
        return vec3(
            dvec3(glm::dot(p, axes.right), glm::dot(p, axes.up), glm::dot(p, axes.forward)));
    };
    SeenObject object;
    std::vector<dvec3> points;
    double bottom = std::numeric_limits<double>::infinity();
    for (const vec3& position : positions) {
        if (!all_finite(position)) continue;
        points.push_back((dvec3(position) - box.centre) / box.radius());
        bottom = std::min(bottom, glm::dot(points.back(), up));
    }
    for (const dvec3& p : points) {
        const double part = (glm::dot(light, up) - bottom) / glm::dot(light - p, up);
        object.vertices.push_back(seen(p));
        object.shadows.push_back(seen(light + part * (p - light)));
    }
    return object;
}

}  // namespace

ImageParams make_image_params(const ViewSpec& view, const WorldBounds& bounds,
                              const SceneSpace& space) {
    assert(view.rays <= kRaysAo);
    check_size(view);
    const ResolvedView resolved = resolve_view(view, bounds);
    check_view(view, resolved);
    const vec3 org = space.point_to_scene(to_dvec3(resolved.eye), "the eye");

    ImageParams params = {};
    if (view.pinhole) {
        check_pinhole(view, *view.pinhole);
        params.camera = make_pinhole_camera(*view.pinhole, org);
    } else {
        params.camera = make_camera(view, checked_axes(view, resolved), org);
    }
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

ResolvedView resolve_view(const ViewSpec& view, const WorldBounds& bounds) {
    const SceneBox scene = scene_box(bounds);
    dvec3 target = view.target ? to_dvec3(*view.target) : scene.centre;
    dvec3 up = to_dvec3(view.up);
    dvec3 eye;
    if (view.pinhole) {
        eye = view.pinhole->org;
        target = eye + view.pinhole->forward;
        up = -view.pinhole->down;
    } else if (view.eye) {
        eye = to_dvec3(*view.eye);
        if (!view.target && eye == target) target.z -= scene.radius();
    } else {
        const dvec3 from = direction_of(kDefaultSide);
        const Axes axes = axes_of(-from, up);
        const HalfSlopes slopes = framing_slopes(view);
        if (!view.target) target = framing_target(slopes, axes, scene);
        eye = target + framing_distance(slopes, axes, kLeastDepth * scene.radius(),
                                        corners_of(scene), target, 1) *
                           from;
    }
    const Axes axes = axes_of(direction_of(target - eye), up);
    const dvec3 light = view.light ? to_dvec3(*view.light) : default_light(eye, axes, scene);
    const double ao_distance = view.ao_distance == 0 ? scene.radius() / 2 : view.ao_distance;
    return {to_point(eye), to_point(target), to_point(light), ao_distance};
}

ViewSpec frame_object(const ViewSpec& view, std::span<const vec3> positions) {
    const dvec3 up = direction_of(to_dvec3(view.up));
    const WorldBounds bounds = bounds_of(positions);
    if (bounds.empty() || !(glm::length(up) > 0)) return view;
    const SceneBox box = scene_box(bounds);
    const Axes axes = axes_of(-direction_of(default_side(up)), up);
    const dvec3 front = glm::cross(axes.right, up);
    const dvec3 light =
        kLightDistance * direction_of(up - kLightLeft * axes.right + kLightFront * front);
    const SeenObject object = see_object(positions, box, axes, up, light);

    const HalfSlopes slopes = framing_slopes(view);
    dvec3 target(0, 0, 0);
    double distance = object.distance(slopes, target);
    // The middle moves less with each step.
    constexpr int kSteps = 8;
    constexpr double kSettled = 1e-4;
    dvec3 shift(distance);
    for (int step = 0; step < kSteps && glm::length(shift) > kSettled * distance; ++step) {
        dvec3 lower(std::numeric_limits<double>::infinity());
        dvec3 upper = -lower;
        for (const vec3& vertex : object.vertices) {
            const dvec3 p = dvec3(vertex) - target;
            const dvec3 slope = p / (distance + p.z);
            lower = glm::min(lower, slope);
            upper = glm::max(upper, slope);
        }
        shift = distance / 2 * dvec3(lower.x + upper.x, lower.y + upper.y, 0);
        target += shift;
        distance = object.distance(slopes, target);
    }
    const dvec3 middle = box.centre + box.radius() * (target.x * axes.right + target.y * axes.up);
    ViewSpec framed = view;
    framed.eye = to_point(middle - box.radius() * distance * axes.forward);
    framed.target = to_point(middle);
    if (!view.light) framed.light = to_point(box.centre + box.radius() * light);
    return framed;
}

}  // namespace mray
