// Rays, points and hits between world space and scene space.
#pragma once

#include <algorithm>
#include <bit>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>

#include "common/interop/ray.h"
#include "common/scene/scene_space.h"
#include "common/simd/simd_target.h"
#include "cpu/scene_space/to_scene.h"
#include "library/src/scene/mesh_list.h"
#include "morphray/geometry.hpp"

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

/// t in scene space times 2^t_exponent, rounded to a float; what is too large becomes the largest
/// float.
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

/// Gives rays the bits of mray::to_scene(). t in world space is t in scene space times
/// 2^t_exponent. Threads may use one at the same time.
class RaySpace {
public:
    RaySpace(const mray::SceneSpace& space, const mray::SimdTarget& target);

    /// Half of the longest side of the scene, or up to twice that, in world space.
    double extent() const { return space_.length_to_world(mray::kSceneExtent); }

    /// Converts one ray. Returns its t_exponent; nothing for a ray that cannot hit anything.
    std::optional<int> to_scene(const Ray& world, mray::Ray& scene) const;
    /// Converts at most SceneRays::kMost rays. Those that cannot hit anything become rays without
    /// an interval.
    void to_scene(std::span<const Ray> rays, mray::cpu::SceneRays& scene) const;
    /// Converts a point. Returns whether it is finite and within the reach of origins; if not,
    /// `scene` is not set.
    bool to_scene(const Vec3& world, mray::vec3& scene) const;
    /// The t_exponent of a ray with a direction that is finite and not 0.
    int t_exponent(const Vec3& dir) const { return -(space_.exponent() + largest_exponent(dir)); }

private:
    std::optional<int> to_scene_in_floats(const Ray& world, mray::Ray& scene) const;

    mray::SceneSpace space_;
    mray::SimdTarget target_;
    float centre_[3];
    /// 2^exponent of the space; NaN if it or its inverse is no normal float.
    float scale_;
};

/// A hit in the caller's units and numbers.
inline Hit to_world(const MeshList& meshes, const mray::Hit& hit, int t_exponent) {
    if (hit.prim_id == mray::kNoPrim) return {};
    return meshes.locate(to_world_t(hit.t, t_exponent), hit.u, hit.v, hit.prim_id);
}

}  // namespace morphray::detail
