#include "library/src/ray_space.h"

#include <cmath>

namespace morphray::detail {
namespace {

// The largest exponent of a factor: the power of two and its inverse are normal floats.
constexpr int kMostExponent = 126;

/// A ray in scene space that hits nothing: its interval is empty.
constexpr mray::Ray kNoRay = {.org = {0, 0, 0}, .tnear = 1, .dir = {0, 0, 1}, .tfar = 0};

mray::WorldRay world_ray(const Ray& ray) {
    return {
        {ray.org.x, ray.org.y, ray.org.z}, {ray.dir.x, ray.dir.y, ray.dir.z}, ray.tnear, ray.tfar};
}

}  // namespace

RaySpace::RaySpace(const mray::SceneSpace& space, const mray::SimdTarget& target)
    : space_(space),
      target_(target),
      centre_{static_cast<float>(space.centre(0)), static_cast<float>(space.centre(1)),
              static_cast<float>(space.centre(2))},
      scale_(std::abs(space.exponent()) <= kMostExponent ? std::ldexp(1.0f, space.exponent())
                                                         : std::nanf("")) {}

/// Returns nothing for rays that need more than floats. For one ray it is faster than
/// make_scene_rays() (cpu/scene_space/to_scene.cpp says why the bits are those of doubles).
std::optional<int> RaySpace::to_scene_in_floats(const Ray& world, mray::Ray& scene) const {
    const float org[3] = {world.org.x, world.org.y, world.org.z};
    bool is_near = true;
    for (int axis = 0; axis < 3; ++axis) {
        const float scaled = (org[axis] - centre_[axis]) * scale_;
        is_near &= std::abs(scaled) < mray::kFarOrigin;
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
    const int exponent = space_.exponent() + (static_cast<int>(power >> 23) - 127);
    const auto t_scale = std::bit_cast<float>(static_cast<std::uint32_t>(exponent + 127) << 23);
    scene.tnear = std::min(std::max(world.tnear, 0.0f) * t_scale, mray::kInfiniteT);
    scene.tfar = std::min(world.tfar * t_scale, mray::kInfiniteT);
    if (scene.tnear < 0x1p-100f) scene.tnear = 0;
    const bool is_plain = is_near & (power - 0x00800000u < 0x7E800000u) &
                          (std::abs(exponent) <= kMostExponent) & (world.tnear <= world.tfar) &
                          (scene.tfar >= 0x1p-100f);
    return is_plain ? std::optional(-exponent) : std::nullopt;
}

std::optional<int> RaySpace::to_scene(const Ray& world, mray::Ray& scene) const {
    if (const std::optional<int> exponent = to_scene_in_floats(world, scene)) return exponent;
    const mray::SceneRay ray = mray::to_scene(space_, world_ray(world));
    scene = ray.ray;
    if (!ray.valid) return std::nullopt;
    return ray.t_exponent + (ray.t_start != 0 ? kFarRay : 0);
}

float RaySpace::t_of_far_ray(const Ray& world, float t) const {
    const mray::SceneRay ray = mray::to_scene(space_, world_ray(world));
    constexpr double kLargest = std::numeric_limits<float>::max();
    const double world_t = ray.t_start + std::ldexp(double{t}, ray.t_exponent);
    return static_cast<float>(std::min(world_t, kLargest));
}

float RaySpace::to_scene_t(const Ray& world, float t, int t_exponent) const {
    const double start = is_far(t_exponent) ? mray::to_scene(space_, world_ray(world)).t_start : 0;
    const int exponent = is_far(t_exponent) ? t_exponent - kFarRay : t_exponent;
    return static_cast<float>(std::ldexp(double{t} - start, -exponent));
}

void RaySpace::to_scene(std::span<const Ray> rays, mray::cpu::SceneRays& scene) const {
    mray::cpu::make_scene_rays(space_, target_, stored(rays), scene);
    for (std::size_t k = 0; k < scene.hard_count; ++k) {
        const std::size_t i = scene.hard[k];
        const std::optional<int> exponent = to_scene(rays[i], scene.rays[i]);
        if (!exponent) scene.rays[i] = kNoRay;
        scene.t_exponents[2 * i + 1] = exponent.value_or(0);
    }
}

void RaySpace::to_scene(const Vec3& world, glm::dvec3& exact, mray::vec3& scene) const {
    const float given[3] = {world.x, world.y, world.z};
    for (int axis = 0; axis < 3; ++axis) {
        exact[axis] = space_.length_to_scene(double{given[axis]} - space_.centre(axis));
        const auto rounded =
            static_cast<float>(std::clamp(exact[axis], -mray::kMostPoint, mray::kMostPoint));
        scene[axis] = std::abs(exact[axis]) < 0x1p-60 ? 0.0f : mray::snap_coordinate(rounded);
        if (std::abs(rounded) < mray::kCoordinateOnGrid) exact[axis] = double{scene[axis]};
    }
}

}  // namespace morphray::detail
