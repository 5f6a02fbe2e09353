// A refit on the device gives the bytes of a refit on the CPU.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "common/bvh/builder/bvh_builder.h"
#include "common/update/restructure.h"
#include "cpu/cpu_backend.h"
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

/// Parts the torus into groups of sixteen rings, each moved in a direction of its own.
std::vector<vec3> parted(const DeviceScene& scene, std::uint32_t sides, float distance) {
    std::vector<vec3> positions = scene.positions;
    for (std::size_t i = 0; i < positions.size(); ++i) {
        const auto ring = static_cast<float>(i / sides / 16);
        positions[i] +=
            distance * 0x1p16f *
            vec3(std::fmod(ring * 0.7f, 2.0f) - 1.0f, std::fmod(ring * 1.3f, 2.0f) - 1.0f, 0.0f);
    }
    return positions;
}

void expect_same_restructurings(bool force_staging) {
    gpu::Tuning tuning;
    tuning.force_staging = force_staging;
    tuning.buffer_kind = force_staging ? gpu::BufferKind::kStorage : gpu::BufferKind::kTexels;
    const auto vulkan = validated_device(tuning);
    const auto cpu = cpu::make_scalar_backend();
    constexpr std::uint32_t kSides = 32;
    const DeviceScene scene = torus(128, kSides);
    const Bvh built = build_bvh(scene.topology, scene.positions);
    BuiltAreas areas = built_areas(built);
    BuiltAreas cpu_areas = areas;
    for (Backend* backend : std::initializer_list<Backend*>{vulkan.get(), cpu.get()}) {
        backend->set_scene(scene.topology, scene.positions, built);
    }
    bool any = false;
    for (const float distance : {0.2f, 0.4f, 0.6f, 0.8f, 1.0f, 1.2f}) {
        const std::vector<vec3> positions = parted(scene, kSides, distance);
        vulkan->refit(positions);
        cpu->refit(positions);
        const auto restructured = [&](Backend& backend, BuiltAreas& its_areas) {
            std::size_t parts = 0;
            backend.edit_tree([&](Bvh& bvh) {
                parts = restructure(scene.topology, positions, 1, 1, bvh, its_areas);
                return parts > 0;
            });
            return parts;
        };
        const std::size_t parts = restructured(*cpu, cpu_areas);
        any = any || parts > 0;
        EXPECT_EQ(restructured(*vulkan, areas), parts);
        Bvh expected, actual;
        cpu->read_tree(expected);
        vulkan->read_tree(actual);
        ASSERT_TRUE(same_tree(expected, actual)) << distance;
        EXPECT_EQ(expected.leaf_vertices, actual.leaf_vertices);
        // A refit reads the tables, which must have arrived, too.
        vulkan->refit(scene.positions);
        cpu->refit(scene.positions);
        cpu->read_tree(expected);
        vulkan->read_tree(actual);
        ASSERT_TRUE(same_tree(expected, actual)) << distance;
    }
    EXPECT_TRUE(any);
}

TEST(VulkanRestructuring, EqualsTheCpu) { expect_same_restructurings(false); }

TEST(VulkanRestructuring, ThroughStagingEqualsTheCpu) { expect_same_restructurings(true); }

}  // namespace
}  // namespace mray::test
