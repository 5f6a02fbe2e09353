#include "library/src/queries/ray_space.h"

namespace morphray::detail {
namespace {

/// A ray in scene space that hits nothing: its interval is empty.
constexpr mray::Ray kNoRay = {.org = {0, 0, 0}, .tnear = 1, .dir = {0, 0, 1}, .tfar = 0};

}  // namespace

void RaySpace::set(const mray::SceneSpace& space) {
    converter_.emplace(space);
    ray_maker_.emplace(space, target_);
    extent_ = space.length_to_world(mray::kSceneExtent);
}

void RaySpace::to_scene(std::span<const Ray> rays, mray::cpu::SceneRays& scene) const {
    static_assert(sizeof(Ray) == sizeof(mray::StoredRay));
    ray_maker_->make({reinterpret_cast<const mray::StoredRay*>(rays.data()), rays.size()}, scene);
    for (std::size_t k = 0; k < scene.hard_count; ++k) {
        const std::size_t i = scene.hard[k];
        const RayScale scale = converter_->to_scene(rays[i], scene.rays[i]);
        if (!scale.is_valid) scene.rays[i] = kNoRay;
        scene.t_exponents[2 * i + 1] = scale.t_exponent;
    }
}

}  // namespace morphray::detail
