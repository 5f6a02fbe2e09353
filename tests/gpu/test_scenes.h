// Devices under validation, and poses, trees and views of the scenes of tests/support/test_scene.h.
#pragma once

#include <cmath>
#include <memory>
#include <vector>

#include "common/backend.h"
#include "common/bvh/builder/bvh_builder.h"
#include "cpu/refit/refit.h"
#include "gpu/shared_device.h"
#include "tests/support/test_scene.h"

namespace mray::test {

/// A backend on the first usable device, whose calls throw if the validation layer reports an
/// error.
inline std::unique_ptr<Backend> validated_device(const gpu::Tuning& tuning = {}) {
    return gpu::make_vulkan_backend({.device = "", .validate = true}, tuning);
}

/// The vertices, moved towards the origin and back by a smooth motion.
inline std::vector<vec3> swayed(const TestScene& scene, float time) {
    std::vector<vec3> positions = scene.positions();
    for (vec3& p : positions) {
        if (!is_finite_vertex(p)) continue;
        const vec3 q = p * (4 / kSceneExtent);
        p = snap_point(p * (0.8f + 0.2f * std::sin(q.x + 2 * q.y - q.z + time)));
    }
    return positions;
}

inline Bvh built_tree(const TestScene& scene) {
    return build_bvh(scene.topology(), scene.positions());
}

/// A tree of bad quality and another shape: built for vertices that have changed places.
inline Bvh loose_tree(const TestScene& scene) {
    std::vector<vec3> positions = scene.positions();
    Random random(1);
    for (vec3& p : positions) std::swap(p, random.pick(positions));
    Bvh bvh = build_bvh(scene.topology(), positions);
    cpu::refit(bvh, scene.positions());
    return bvh;
}

inline void set_scene(Backend& backend, const TestScene& scene, const Bvh& bvh) {
    backend.set_scene(scene.topology(), scene.pose(), bvh);
}

/// A view that shows any scene.
inline ImageParams view(std::uint32_t width, std::uint32_t height, std::uint32_t rays,
                        std::uint32_t ao_count = 4) {
    constexpr float kUnit = kSceneExtent / 4;
    const float w = static_cast<float>(width);
    const float h = static_cast<float>(height);
    ImageParams params = {};
    params.camera.org = vec3(0, 3, 8) * kUnit;
    params.camera.corner = vec3(-0.5f * w / h, 0.2f, -1);
    params.camera.du = vec3(1 / h, 0, 0);
    params.camera.dv = vec3(0, -1 / h, 0);
    params.light = vec3(-6, 8, 5) * kUnit;
    params.ao_tfar = 1.5f * kUnit;
    params.width = width;
    params.height = height;
    params.rays = rays;
    params.ao_count = ao_count;
    return params;
}

}  // namespace mray::test
