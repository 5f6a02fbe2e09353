// A refit on the device gives the bytes of a refit on the CPU.
#include <gtest/gtest.h>

#include "common/bvh/builder/bvh_builder.h"
#include "cpu/refit/refit.h"
#include "tests/gpu/test_scenes.h"
#include "tests/gpu/validated_device.h"
#include "tests/support/same_bits.h"

namespace mray::test {
namespace {

bool same_tree(const Bvh& a, const Bvh& b) {
    return same_bytes(a.nodes, b.nodes) && same_bytes(a.leaves, b.leaves);
}

/// Refits `frames` times on both sides, and then to the first pose.
void expect_same_refits(Backend& vulkan, const DeviceScene& scene, const Bvh& built, int frames) {
    Bvh expected = built;
    Bvh actual = built;
    vulkan.set_scene(scene.topology, scene.positions, built);
    for (int frame = 0; frame < frames; ++frame) {
        const std::vector<vec3> positions = swayed(scene, 0.05f * static_cast<float>(frame));
        cpu::refit(expected, positions);
        vulkan.refit(positions);
        vulkan.read_tree(actual);
        ASSERT_TRUE(same_tree(expected, actual)) << scene.name << ", frame " << frame;
    }
    vulkan.refit(scene.positions);
    vulkan.read_tree(actual);
    EXPECT_TRUE(same_tree(built, actual)) << scene.name;
}

TEST(VulkanRefit, EqualsTheCpuForTwoHundredFrames) {
    const std::unique_ptr<Backend> vulkan = validated_device();
    const DeviceScene scene = torus(64, 32);
    expect_same_refits(*vulkan, scene, build_bvh(scene.topology, scene.positions), 200);
}

TEST(VulkanRefit, EqualsTheCpuForEveryKindOfScene) {
    const std::unique_ptr<Backend> vulkan = validated_device();
    for (const DeviceScene& scene : test_scenes()) {
        expect_same_refits(*vulkan, scene, build_bvh(scene.topology, scene.positions), 3);
        expect_same_refits(*vulkan, scene, plain_tree(scene), 3);
    }
}

TEST(VulkanRefit, BoundsNothingWhereNoVertexIsFinite) {
    const std::unique_ptr<Backend> vulkan = validated_device();
    const DeviceScene scene = torus(16, 8);
    Bvh expected = build_bvh(scene.topology, scene.positions);
    Bvh actual = expected;
    vulkan->set_scene(scene.topology, scene.positions, expected);
    const std::vector<vec3> nowhere(scene.positions.size(), vec3(kInvalidCoordinate));
    cpu::refit(expected, nowhere);
    vulkan->refit(nowhere);
    vulkan->read_tree(actual);
    EXPECT_TRUE(same_tree(expected, actual));
}

TEST(VulkanRefit, FrameWithATreeOfAnotherShapeReplacesTheTree) {
    const std::unique_ptr<Backend> vulkan = validated_device();
    const DeviceScene scene = torus(32, 16);
    const Bvh plain = plain_tree(scene);
    const Bvh built = build_bvh(scene.topology, scene.positions);
    ASSERT_NE(plain.nodes.size(), built.nodes.size());
    vulkan->set_scene(scene.topology, scene.positions, plain);
    vulkan->set_frame(scene.positions, built);
    Bvh actual = built;
    for (Leaf& leaf : actual.leaves) leaf = Leaf{};
    vulkan->read_tree(actual);
    EXPECT_TRUE(same_tree(built, actual));
}

}  // namespace
}  // namespace mray::test
