#include "library/src/queries/world_ray.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "common/interop/arithmetic.h"

namespace morphray::detail {
namespace {

bool is_finite(const Vec3& v) {
    // x - x is 0 for finite x and NaN for others.
    return (v.x - v.x) + (v.y - v.y) + (v.z - v.z) == 0;
}

/// 2^exponent, for exponents of normal doubles.
double power_of_two(int exponent) {
    return std::bit_cast<double>(static_cast<std::uint64_t>(exponent + 1023) << 52);
}

/// Rounds a coordinate of scene space to a float that is no denormal.
float rounded(double scaled) {
    return std::abs(scaled) < 0x1p-60 ? 0.0f : static_cast<float>(scaled);
}

float interval_end(double scaled) {
    return static_cast<float>(std::min(scaled, static_cast<double>(mray::kInfiniteT)));
}

}  // namespace

RayConverter::RayConverter(const mray::SceneSpace& space)
    : exponent_(space.exponent()),
      centre_{space.centre(0), space.centre(1), space.centre(2)},
      scale_(std::ldexp(1.0, space.exponent())),
      centre_in_floats_{static_cast<float>(space.centre(0)), static_cast<float>(space.centre(1)),
                        static_cast<float>(space.centre(2))},
      scale_in_floats_(std::abs(space.exponent()) <= kMostExponent
                           ? static_cast<float>(scale_)
                           : std::numeric_limits<float>::quiet_NaN()) {}

bool RayConverter::to_scene(const Vec3& world, mray::vec3& scene) const {
    if (!is_finite(world)) return false;
    const float point[3] = {world.x, world.y, world.z};
    mray::vec3 placed;
    for (int axis = 0; axis < 3; ++axis) {
        const double scaled = (static_cast<double>(point[axis]) - centre_[axis]) * scale_;
        if (!(std::abs(scaled) <= mray::kOriginExtent)) return false;
        placed[axis] = mray::snap_coordinate(rounded(scaled));
    }
    scene = placed;
    return true;
}

/// As to_scene(), but refuses rays with numbers that need more than floats, too. It does what
/// SceneRayMaker does in vectors (cpu/scene_space/scene_rays.cpp says why the bits are those of
/// doubles), in a shorter chain of operations, for which a call for one ray waits.
RayScale RayConverter::to_scene_in_floats(const Ray& world, mray::Ray& scene) const {
    const float org[3] = {world.org.x, world.org.y, world.org.z};
    bool is_near = true;
    for (int axis = 0; axis < 3; ++axis) {
        const float scaled = (org[axis] - centre_in_floats_[axis]) * scale_in_floats_;
        is_near &= std::abs(scaled) < mray::kOriginExtent;
        scene.org[axis] = mray::snap_coordinate(scaled);
    }
    // Bits of numbers that are not negative are in their order; those of NaN are the largest.
    const std::uint32_t largest =
        std::max({magnitude(world.dir.x), magnitude(world.dir.y), magnitude(world.dir.z)});
    const std::uint32_t power = largest & 0x7F800000u;
    const auto dir_scale = std::bit_cast<float>(0x7F000000u - power);
    const float dir[3] = {world.dir.x, world.dir.y, world.dir.z};
    for (int axis = 0; axis < 3; ++axis)
        scene.dir[axis] = mray::snap_direction_component(dir[axis] * dir_scale);
    const int exponent = exponent_ + (static_cast<int>(power >> 23) - 127);
    const auto t_scale = std::bit_cast<float>(static_cast<std::uint32_t>(exponent + 127) << 23);
    scene.tnear = std::min(std::max(world.tnear, 0.0f) * t_scale, mray::kInfiniteT);
    scene.tfar = std::min(world.tfar * t_scale, mray::kInfiniteT);
    if (scene.tnear < 0x1p-100f) scene.tnear = 0;
    const bool is_plain = is_near & (power - 0x00800000u < 0x7E800000u) &
                          (std::abs(exponent) <= kMostExponent) & (world.tnear <= world.tfar) &
                          (scene.tfar >= 0x1p-100f);
    return {-exponent, is_plain};
}

RayScale RayConverter::to_scene(const Ray& world, mray::Ray& scene) const {
    const RayScale plain = to_scene_in_floats(world, scene);
    return plain.is_valid ? plain : to_scene_in_doubles(world, scene);
}

RayScale RayConverter::to_scene_in_doubles(const Ray& world, mray::Ray& scene) const {
    if (!to_scene(world.org, scene.org) || !is_finite(world.dir)) return {};
    const float dir[3] = {world.dir.x, world.dir.y, world.dir.z};
    const bool has_length = dir[0] != 0 || dir[1] != 0 || dir[2] != 0;
    if (!has_length || !(world.tnear <= world.tfar) || !(world.tfar >= 0)) return {};
    const int exponent = largest_exponent(world.dir);
    const double dir_scale = power_of_two(-exponent);
    for (int axis = 0; axis < 3; ++axis) {
        scene.dir[axis] =
            mray::snap_direction_component(rounded(static_cast<double>(dir[axis]) * dir_scale));
    }
    const double t_scale = scale_ * power_of_two(exponent);
    scene.tnear = interval_end(std::max(static_cast<double>(world.tnear), 0.0) * t_scale);
    scene.tfar = interval_end(static_cast<double>(world.tfar) * t_scale);
    if (scene.tnear < 0x1p-100f) scene.tnear = 0;
    return {-(exponent_ + exponent), scene.tfar >= 0x1p-100f};
}

float to_world_t_in_doubles(float t, int t_exponent) {
    constexpr double kLargest = std::numeric_limits<float>::max();
    return static_cast<float>(std::min(t * power_of_two(t_exponent), kLargest));
}

}  // namespace morphray::detail
