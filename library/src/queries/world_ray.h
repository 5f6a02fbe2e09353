// Rays and points of the caller, brought into scene space.
#pragma once

#include <algorithm>
#include <bit>
#include <cstdint>
#include <limits>

#include "common/interop/ray.h"
#include "common/scene/scene_space.h"
#include "morphray/geometry.hpp"

namespace morphray::detail {

/// The factor between hits of a ray in scene space and hits in world space.
struct RayScale {
    /// t in world space is t in scene space times 2^t_exponent.
    int t_exponent = 0;
    /// Whether the ray can hit anything; if not, its ray in scene space is not set.
    bool is_valid = false;
};

/// The largest exponent of a power of two that floats are multiplied by: it and its inverse are
/// normal.
inline constexpr int kMostExponent = 126;

/// The bits of |x|. Those of numbers are in their order.
inline std::uint32_t magnitude(float x) { return std::bit_cast<std::uint32_t>(x) & 0x7FFFFFFFu; }

/// The exponent of the largest component of a vector that is finite and not 0.
inline int largest_exponent(const Vec3& v) {
    const std::uint32_t largest = std::max({magnitude(v.x), magnitude(v.y), magnitude(v.z)});
    if (largest >= 0x00800000u) return static_cast<int>(largest >> 23) - 127;
    // As a double no float is a denormal.
    const auto size = static_cast<double>(std::bit_cast<float>(largest));
    return static_cast<int>(std::bit_cast<std::uint64_t>(size) >> 52) - 1023;
}

/// A ray of floats in scene space, with the bits of mray::to_scene(). This one scales by
/// multiplications, which are exact: all exponents are within +-400. Most rays need floats alone.
class RayConverter {
public:
    explicit RayConverter(const mray::SceneSpace& space);

    RayScale to_scene(const Ray& world, mray::Ray& scene) const;
    /// Brings a point into scene space. Returns whether it is finite and within the reach of
    /// origins; if not, `scene` is not set.
    bool to_scene(const Vec3& world, mray::vec3& scene) const;
    /// RayScale::t_exponent of a ray with a direction that is finite and not 0.
    int t_exponent(const Vec3& dir) const { return -(exponent_ + largest_exponent(dir)); }

private:
    RayScale to_scene_in_floats(const Ray& world, mray::Ray& scene) const;
    RayScale to_scene_in_doubles(const Ray& world, mray::Ray& scene) const;

    int exponent_;
    double centre_[3];
    /// 2^exponent of the space.
    double scale_;
    /// The same as floats. scale_in_floats_ is NaN if it or its inverse is no normal float.
    float centre_in_floats_[3];
    float scale_in_floats_;
};

/// As to_world_t(), for all exponents.
float to_world_t_in_doubles(float t, int t_exponent);

/// t in scene space times 2^t_exponent, rounded to a float; what is too large becomes the largest
/// float.
inline float to_world_t(float t, int t_exponent) {
    if (t_exponent < -kMostExponent || t_exponent > kMostExponent)
        return to_world_t_in_doubles(t, t_exponent);
    const auto bits = static_cast<std::uint32_t>(t_exponent + 127) << 23;
    return std::min(t * std::bit_cast<float>(bits), std::numeric_limits<float>::max());
}

}  // namespace morphray::detail
