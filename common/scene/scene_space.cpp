#include "common/scene/scene_space.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "common/base/errors.h"
#include "common/interop/arithmetic.h"

namespace mray {

void WorldBounds::extend(const double other_lower[3], const double other_upper[3]) {
    const bool was_empty = empty();
    for (int axis = 0; axis < 3; ++axis) {
        lower[axis] = was_empty ? other_lower[axis] : std::min(lower[axis], other_lower[axis]);
        upper[axis] = was_empty ? other_upper[axis] : std::max(upper[axis], other_upper[axis]);
    }
}

WorldBounds bounds_of(std::span<const vec3> points) {
    WorldBounds bounds;
    for (const vec3 p : points) {
        if (!std::isfinite(p.x) || !std::isfinite(p.y) || !std::isfinite(p.z)) continue;
        const double point[3] = {p.x, p.y, p.z};
        bounds.extend(point, point);
    }
    return bounds;
}

namespace {

constexpr int kExtentExponent = 20;
static_assert(kSceneExtent == 1 << kExtentExponent);

bool finite(vec3 p) { return std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z); }

// Sterbenz: x - c is exact for floats with c/2 <= x <= 2c. The midpoint c of [lower, upper] has
// that for both ends if upper <= 3 * lower (or mirrored); rounding c to float needs a little room.
double exact_centre(double lower, double upper) {
    const double nearer = std::min(std::abs(lower), std::abs(upper));
    const double farther = std::max(std::abs(lower), std::abs(upper));
    if (lower * upper <= 0 || farther > 2.9 * nearer) return 0;
    return static_cast<float>((lower + upper) / 2);
}

/// Whether a corner of bounds of floats is in the range of scene space.
bool holds(const SceneSpace& space, const double corner[3]) {
    const vec3 scene = space.to_scene(vec3(corner[0], corner[1], corner[2]));
    const float farthest = std::max({std::abs(scene.x), std::abs(scene.y), std::abs(scene.z)});
    return farthest <= kSceneExtent;
}

}  // namespace

SceneSpace::SceneSpace(const WorldBounds& bounds) {
    if (bounds.empty()) return;
    double extent = 0;
    for (int axis = 0; axis < 3; ++axis) {
        centre_[axis] = exact_centre(bounds.lower[axis], bounds.upper[axis]);
        extent = std::max({extent, std::abs(bounds.lower[axis] - centre_[axis]),
                           std::abs(bounds.upper[axis] - centre_[axis])});
    }
    // All points coincide: their own size gives the scale.
    if (extent == 0) {
        for (int axis = 0; axis < 3; ++axis) extent = std::max(extent, std::abs(centre_[axis]));
    }
    if (extent == 0) return;
    int exponent = 0;
    const double mantissa = std::frexp(extent, &exponent);  // extent = mantissa * 2^exponent
    if (mantissa == 0.5) --exponent;                        // exactly 2^20 is inside
    exponent_ = kExtentExponent - exponent;
    scale_ = std::ldexp(1.0, exponent_);
}

vec3 SceneSpace::to_scene(vec3 world) const {
    if (!finite(world)) return {kInvalidCoordinate, kInvalidCoordinate, kInvalidCoordinate};
    vec3 scene;
    for (int axis = 0; axis < 3; ++axis) {
        // Exact: floats and the scale of their extent are within 2^+-170.
        const double scaled = (static_cast<double>(world[axis]) - centre_[axis]) * scale_;
        // A value below the grid must not round to a float denormal on the way to it.
        scene[axis] =
            std::abs(scaled) < 0x1p-60 ? 0.0f : snap_coordinate(static_cast<float>(scaled));
    }
    return scene;
}

void SceneSpace::to_scene(std::span<const vec3> world, std::span<vec3> scene) const {
    for (std::size_t i = 0; i < world.size(); ++i) scene[i] = to_scene(world[i]);
}

vec3 SceneSpace::to_world(vec3 scene) const {
    vec3 world;
    for (int axis = 0; axis < 3; ++axis) {
        world[axis] = static_cast<float>(std::ldexp(static_cast<double>(scene[axis]), -exponent_) +
                                         centre_[axis]);
    }
    return world;
}

double SceneSpace::length_to_scene(double world) const { return std::ldexp(world, exponent_); }
double SceneSpace::length_to_world(double scene) const { return std::ldexp(scene, -exponent_); }

vec3 SceneSpace::point_to_scene(const double world[3], const char* what) const {
    vec3 scene;
    for (int axis = 0; axis < 3; ++axis) {
        const double scaled = std::ldexp(world[axis] - centre_[axis], exponent_);
        if (!(std::abs(scaled) <= kOriginExtent)) {
            throw Error(ErrorKind::kBadInput, std::string(what) +
                                                  " is not finite or is more than a million scene "
                                                  "sizes away; move it closer");
        }
        scene[axis] =
            std::abs(scaled) < 0x1p-60 ? 0.0f : snap_coordinate(static_cast<float>(scaled));
    }
    return scene;
}

SceneSpace space_of_frame(const WorldBounds& reference, const WorldBounds& frame) {
    const SceneSpace space(reference);
    if (frame.empty() || (holds(space, frame.lower) && holds(space, frame.upper))) return space;
    WorldBounds both = reference;
    both.extend(frame.lower, frame.upper);
    return SceneSpace(both);
}

SceneRay to_scene(const SceneSpace& space, const WorldRay& world) {
    SceneRay result;
    double largest = 0;
    for (int axis = 0; axis < 3; ++axis) {
        if (!std::isfinite(world.org[axis]) || !std::isfinite(world.dir[axis])) return result;
        largest = std::max(largest, std::abs(world.dir[axis]));
    }
    if (largest == 0 || !(world.tnear <= world.tfar) || !(world.tfar >= 0)) return result;
    int dir_exponent = std::ilogb(largest);
    // A value that rounds up to 2 takes the next exponent.
    if (static_cast<float>(std::ldexp(largest, -dir_exponent)) == 2.0f) ++dir_exponent;
    try {
        result.ray.org = space.point_to_scene(world.org, "ray origin");
    } catch (const Error&) {
        return result;
    }
    for (int axis = 0; axis < 3; ++axis) {
        const double scaled = std::ldexp(world.dir[axis], -dir_exponent);
        result.ray.dir[axis] = snap_direction_component(
            std::abs(scaled) < 0x1p-60 ? 0.0f : static_cast<float>(scaled));
    }
    // org + t * dir in both spaces: t_scene * 2^-dir_exponent... = t_world * 2^exponent *
    // 2^dir_exponent.
    result.t_exponent = -(space.exponent() + dir_exponent);
    const double tnear = std::ldexp(std::max(world.tnear, 0.0), -result.t_exponent);
    const double tfar = std::ldexp(world.tfar, -result.t_exponent);
    result.ray.tnear = static_cast<float>(std::min(tnear, static_cast<double>(kInfiniteT)));
    result.ray.tfar = static_cast<float>(std::min(tfar, static_cast<double>(kInfiniteT)));
    if (result.ray.tnear < 0x1p-100f) result.ray.tnear = 0;
    if (result.ray.tfar < 0x1p-100f) return result;
    result.valid = true;
    return result;
}

}  // namespace mray
