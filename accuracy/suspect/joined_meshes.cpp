#include "accuracy/suspect/joined_meshes.h"

#include <algorithm>
#include <cstdint>
#include <random>
#include <utility>

namespace mray::accuracy {
namespace {

/// Gives `count` edges a vertex in their middle that one of their two triangles uses, and fills the
/// crack with a triangle. Each directed edge keeps its opposite.
FailureScene with_joints(FailureScene scene, std::size_t count) {
    std::mt19937 random(1);
    std::vector<uvec3>& triangles = scene.topology.triangles;
    for (std::size_t n = 0; n < count; ++n) {
        const std::size_t i = random() % triangles.size();
        const uvec3 old = triangles[i];
        const auto middle = static_cast<std::uint32_t>(scene.positions.size());
        const vec3 a = scene.positions[old.x];
        scene.positions.push_back(a + (scene.positions[old.y] - a) * 0.5f);
        triangles[i] = {old.x, middle, old.z};
        triangles.push_back({middle, old.y, old.z});
        triangles.push_back({old.x, old.y, middle});
    }
    scene.topology.vertex_count = static_cast<std::uint32_t>(scene.positions.size());
    scene.topology.albedo.resize(triangles.size(), kDefaultAlbedo);
    scene.name = "T-joints";
    return scene;
}

FailureScene collapsed(FailureScene scene, std::size_t count) {
    std::mt19937 random(2);
    for (std::size_t n = 0; n < count; ++n) {
        const uvec3 t = scene.topology.triangles[random() % scene.topology.triangles.size()];
        scene.positions[t.x] = scene.positions[t.y];
    }
    scene.name = "collapsed vertices";
    return scene;
}

FailureScene stretched(FailureScene scene) {
    for (vec3& p : scene.positions) p.x *= 4096;
    scene.name = "closed needles";
    return scene;
}

}  // namespace

std::vector<FailureScene> suspect_scenes() {
    std::vector<FailureScene> scenes = failure_scenes();
    const FailureScene sphere = *std::ranges::find(scenes, "sphere", &FailureScene::name);
    scenes.push_back(with_joints(sphere, 400));
    scenes.push_back(collapsed(sphere, 200));
    scenes.push_back(stretched(sphere));
    return scenes;
}

}  // namespace mray::accuracy
