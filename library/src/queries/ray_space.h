// Rays and hits between world space and scene space.
#pragma once

#include <optional>
#include <span>

#include "common/scene/scene_space.h"
#include "common/simd/simd_target.h"
#include "cpu/scene_space/scene_rays.h"
#include "library/src/queries/world_ray.h"
#include "library/src/scene/mesh_list.h"
#include "morphray/geometry.hpp"

namespace morphray::detail {

/// Threads may use one at the same time, but not during set().
class RaySpace {
public:
    /// Rays that convert() takes at a time.
    static constexpr std::size_t kMost = mray::cpu::SceneRays::kMost;

    /// `meshes` must outlive it.
    RaySpace(const MeshList& meshes, const mray::SimdTarget& target)
        : meshes_(meshes), target_(target) {}

    /// Follows the scene space of a pose. To be called before the others.
    void set(const mray::SceneSpace& space);

    const mray::SimdTarget& target() const { return target_; }
    /// Half of the longest side of the scene, or up to twice that, in world space.
    double extent() const { return extent_; }

    /// Converts one ray.
    RayScale to_scene(const Ray& ray, mray::Ray& scene) const {
        return converter_->to_scene(ray, scene);
    }
    /// RayConverter::to_scene() of a point.
    bool to_scene(const Vec3& point, mray::vec3& scene) const {
        return converter_->to_scene(point, scene);
    }
    /// Converts at most kMost rays. Those that cannot hit anything become rays without an interval.
    void to_scene(std::span<const Ray> rays, mray::cpu::SceneRays& scene) const;
    /// RayScale::t_exponent of a ray with a direction that is finite and not 0.
    int t_exponent(const Vec3& dir) const { return converter_->t_exponent(dir); }
    Hit to_world(const mray::Hit& hit, int t_exponent) const {
        if (hit.prim_id == kNoPrim) return {};
        return meshes_.locate(to_world_t(hit.t, t_exponent), hit.u, hit.v, hit.prim_id);
    }

private:
    const MeshList& meshes_;
    mray::SimdTarget target_;
    std::optional<RayConverter> converter_;
    std::optional<mray::cpu::SceneRayMaker> ray_maker_;
    double extent_ = 1;
};

}  // namespace morphray::detail
