// Rays, points and hits between world space and scene space.
#pragma once

#include "common/interop/ray.h"
#include "common/scene/scene_space.h"
#include "common/scene_queries.h"
#include "common/simd/simd_target.h"
#include "cpu/scene_space/to_scene.h"
#include "library/src/scene/mesh_list.h"

namespace morphray::detail {

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

/// t in scene space times 2^t_exponent, rounded to a float, at most the largest one.
inline float to_world_t(float t, int t_exponent) {
    constexpr float kLargest = std::numeric_limits<float>::max();
    // Floats suffice for normal powers of two.
    if (t_exponent >= -126 && t_exponent <= 126) {
        const auto bits = static_cast<std::uint32_t>(t_exponent + 127) << 23;
        return std::min(t * std::bit_cast<float>(bits), kLargest);
    }
    const auto power = std::bit_cast<double>(static_cast<std::uint64_t>(t_exponent + 1023) << 52);
    return static_cast<float>(std::min(t * power, static_cast<double>(kLargest)));
}

inline std::span<const mray::StoredRay> stored(std::span<const Ray> rays) {
    static_assert(sizeof(Ray) == sizeof(mray::StoredRay));
    return {reinterpret_cast<const mray::StoredRay*>(rays.data()), rays.size()};
}

/// Added to the t_exponent of rays that were moved to the scene from far away.
inline constexpr int kFarRay = 1 << 16;
inline bool is_far(int t_exponent) { return t_exponent >= kFarRay / 2; }

/// Gives rays the bits of mray::to_scene(). t in world space is t in scene space times
/// 2^t_exponent, and more for far rays. Threads may use one at the same time.
class RaySpace {
public:
    RaySpace(const mray::SceneSpace& space, const mray::SimdTarget& target);

    /// Half of the longest side of the scene, or up to twice that, in world space.
    double extent() const { return space_.length_to_world(mray::kSceneExtent); }

    /// Converts one ray. Returns its t_exponent; nothing for a ray that cannot hit anything.
    std::optional<int> to_scene(const Ray& world, mray::Ray& scene) const;
    /// Converts at most SceneRays::kMost rays. Those that hit nothing get no interval.
    void to_scene(std::span<const Ray> rays, mray::cpu::SceneRays& scene) const;
    /// Converts a finite point. Beyond mray::kMostPoint `scene` is one on the same sides.
    void to_scene(const Vec3& world, glm::dvec3& exact, mray::vec3& scene) const;
    /// t in world space of a ray with this t_exponent, rounded to a float, at most the largest.
    float to_world_t(const Ray& world, float t, int t_exponent) const {
        return is_far(t_exponent) ? t_of_far_ray(world, t) : detail::to_world_t(t, t_exponent);
    }
    /// About the t in scene space that becomes `t`.
    float to_scene_t(const Ray& world, float t, int t_exponent) const;
    /// The t_exponent of a ray that is not far, with a direction that is finite and not 0.
    int t_exponent(const Vec3& dir) const { return -(space_.exponent() + largest_exponent(dir)); }

private:
    std::optional<int> to_scene_in_floats(const Ray& world, mray::Ray& scene) const;
    float t_of_far_ray(const Ray& world, float t) const;

    mray::SceneSpace space_;
    mray::SimdTarget target_;
    float centre_[3];
    /// 2^exponent of the space; NaN if it or its inverse is no normal float.
    float scale_;
};

/// The hit of a ray in the caller's units and numbers.
inline Hit to_world(const MeshList& meshes, const RaySpace& space, const Ray& ray,
                    const mray::Hit& hit, int t_exponent) {
    if (hit.prim_id == mray::kNoPrim) return {};
    return meshes.locate(space.to_world_t(ray, hit.t, t_exponent), hit.u, hit.v, hit.prim_id);
}

}  // namespace morphray::detail
