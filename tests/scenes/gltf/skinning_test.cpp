// Skinning has the same bits on every instruction set.
#include "scenes/gltf/pose.h"

#include <gtest/gtest.h>

#include <cstring>
#include <random>
#include <vector>

namespace mray::gltf {
namespace {

constexpr std::size_t kPerVertex = 5;
constexpr std::uint32_t kJoints = 7;

/// Vertices of one skin, whose joints turn and scale, and of which some weights are 0.
GltfScene skinned_scene(std::size_t vertex_count) {
    std::mt19937 random(3);
    std::uniform_real_distribution<float> any(-1, 1);
    GltfScene scene;
    VertexSet& set = scene.meshes[0].sets.emplace_back();
    set.influences.per_vertex = kPerVertex;
    for (std::size_t i = 0; i < vertex_count; ++i) {
        set.positions.emplace_back(any(random), any(random), any(random));
        for (std::size_t k = 0; k < kPerVertex; ++k) {
            set.influences.joints.push_back(static_cast<std::uint16_t>(random() % kJoints));
            const float weight = any(random);
            set.influences.weights.push_back(k == 0 || weight > 0 ? std::abs(weight) : 0.0f);
        }
    }
    Skin& skin = scene.skins[0];
    skin.inverse_binds.resize(kJoints);
    for (std::uint32_t joint = 0; joint <= kJoints; ++joint) {
        Node& node = scene.tree.nodes.emplace_back();
        node.trs.translation = {any(random), any(random), any(random)};
        node.trs.scale = {any(random), 2, any(random)};
        scene.tree.parents_first.push_back(joint);
        if (joint < kJoints) skin.joints.push_back(joint);
    }
    scene.tree.nodes.back().mesh = 0;
    scene.placed_sets.push_back({kJoints, &set, 0u, 0});
    scene.topology.vertex_count = static_cast<std::uint32_t>(vertex_count);
    return scene;
}

TEST(Skinning, HasTheSameBitsOnEveryTarget) {
    constexpr std::size_t kVertices = 2500;
    const GltfScene scene = skinned_scene(kVertices);
    const Pose pose = pose_at(scene, 0);
    const auto placed = [&](const SimdTarget& target) {
        std::vector<vec3> out(kVertices);
        EXPECT_EQ(Skinning(scene, target).place(pose, out), kNoVertex);
        return out;
    };
    const std::vector<vec3> expected = placed(find_simd_target("scalar"));
    for (const SimdTarget& target : supported_simd_targets()) {
        SCOPED_TRACE(target.name);
        const std::vector<vec3> out = placed(target);
        EXPECT_EQ(std::memcmp(out.data(), expected.data(), kVertices * sizeof(vec3)), 0);
    }
}

TEST(Skinning, TellsTheFirstVertexThatIsNotFinite) {
    GltfScene scene = skinned_scene(2500);
    VertexSet& set = scene.meshes[0].sets[0];
    for (const std::size_t vertex : {2047u, 1030u}) set.positions[vertex].y = 1e38f;
    std::vector<vec3> out(2500);
    const Skinning skinning(scene);
    for (Node& node : scene.tree.nodes) node.trs.scale = {4, 4, 4};
    EXPECT_EQ(skinning.place(pose_at(scene, 0), out), 1030u);
}

}  // namespace
}  // namespace mray::gltf
