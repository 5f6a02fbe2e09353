// Which blocks of vertices a pose says have moved.
#include "common/scene/pose.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/test_scene.h"

namespace mray {
namespace {

using namespace test;

TEST(Pose, SeesTheSmallestChangeAndNoneWhereThereIsNone) {
    const TestScene scene = icosphere(3);
    Pose pose = scene.pose();
    pose.move_to(scene.positions());
    EXPECT_EQ(pose.moved_count(), 0u);
    std::vector<vec3> positions = scene.positions();
    positions.back().z = std::nextafter(positions.back().z, 2 * kSceneExtent);
    pose.move_to(positions);
    EXPECT_EQ(pose.moved_blocks(), std::vector{pose.block_count() - 1});
    EXPECT_EQ(pose.positions().back(), positions.back());
    pose.move_to(positions);
    EXPECT_EQ(pose.moved_count(), 0u);
}

TEST(Pose, TellsEachBlockWithAMovedVertexAndNoOther) {
    // Several tasks, and a last block that is not whole.
    std::vector<vec3> positions(70005, vec3(0.5f));
    Pose pose(positions);
    Random random(7);
    for (int round = 0; round < 50; ++round) {
        std::vector<std::uint32_t> expected;
        for (std::uint32_t block = 0; block < pose.block_count(); ++block) {
            if (random.real(0, 1) > 0.02) continue;
            const std::uint32_t vertex = block * kMotionBlock + random.below(kMotionBlock);
            if (vertex >= positions.size()) continue;
            positions[vertex].y += 0.25f;
            expected.push_back(block);
        }
        pose.move_to(positions);
        ASSERT_EQ(pose.moved_count(), expected.size());
        ASSERT_EQ(pose.moved_blocks(), expected);
        ASSERT_TRUE(std::ranges::equal(positions, pose.positions()));
    }
}

TEST(Pose, WritesFromAnyVertexOn) {
    std::vector<vec3> positions(kMotionBlock * 100, vec3(0.5f));
    Pose pose(positions);
    const auto write = [&](std::size_t first, std::size_t count) {
        for (vec3& p : std::span(positions).subspan(first, count)) p.y += 0.25f;
        pose.write(first, std::span(positions).subspan(first, count));
    };
    write(10 * kMotionBlock, 1);
    write(10 * kMotionBlock + 1, kMotionBlock);
    write(39 * kMotionBlock + 5, 11 + kMotionBlock);
    write(70 * kMotionBlock, 0);
    EXPECT_EQ(pose.moved_blocks(), (std::vector<std::uint32_t>{10, 11, 39, 40}));
    EXPECT_TRUE(std::ranges::equal(positions, pose.positions()));
    pose.begin_move();
    EXPECT_EQ(pose.moved_blocks(), std::vector<std::uint32_t>());
}

}  // namespace
}  // namespace mray
