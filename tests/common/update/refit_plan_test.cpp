// A refit of moved parts gives the bytes of a refit of everything.
#include "common/update/refit_plan.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>

#include "common/bvh/box.h"
#include "common/bvh/builder/bvh_builder.h"
#include "common/scene/scene_space.h"
#include "cpu/cpu_backend.h"
#include "cpu/refit/refit.h"
#include "scenes/procedural/procedural.h"
#include "tests/support/animation_positions.h"
#include "tests/support/backend_results.h"
#include "tests/support/test_scene.h"

namespace mray {
namespace {

using namespace test;

/// Moves each vertex with this probability.
std::vector<vec3> partly_moved(const std::vector<vec3>& positions, double probability,
                               std::uint64_t seed) {
    Random random(seed);
    std::vector<vec3> result = positions;
    for (vec3& p : result) {
        if (random.real(0, 1) < probability && is_finite_vertex(p)) p = snap_point(0.75f * p);
    }
    return result;
}

TEST(MovedParts, RefittedAloneGiveTheBytesOfAFullRefit) {
    for (const NamedScene& named : adversarial_scenes()) {
        const TestScene& scene = named.scene;
        Bvh all = build_bvh(scene.topology(), scene.positions());
        Bvh parts_only = all;
        Pose pose = scene.pose();
        const BlockLeaves block_leaves(all, pose.block_count());
        std::vector<vec3> positions = scene.positions();
        for (std::uint64_t step = 0; step < 12; ++step) {
            positions = partly_moved(positions, step % 4 == 3 ? 1 : 0.01, step);
            pose.move_to(positions);
            cpu::refit(all, positions);
            const MovedParts reached = block_leaves.reached(parts_only, pose);
            cpu::refit(parts_only, positions, best_simd_target(), &reached);
            ASSERT_EQ(bvh_hash(parts_only), bvh_hash(all)) << named.name << ", step " << step;
        }
    }
}

TEST(CoveringRanges, AreFewAndCoverEveryIndex) {
    Random random(3);
    for (int trial = 0; trial < 200; ++trial) {
        std::vector<std::uint32_t> indices;
        for (std::uint32_t i = 0; i < 400; ++i) {
            if (random.real(0, 1) < 0.02 * trial) indices.push_back(i);
        }
        for (const std::size_t most : {1u, 2u, 8u, 1000u}) {
            const std::vector<IndexRange> ranges = covering_ranges(indices, most);
            ASSERT_LE(ranges.size(), most);
            std::size_t covered = 0;
            for (const std::uint32_t i : indices) {
                covered += std::any_of(ranges.begin(), ranges.end(), [i](const IndexRange& r) {
                    return r.begin <= i && i < r.end;
                });
            }
            ASSERT_EQ(covered, indices.size());
        }
    }
    const std::uint32_t some[] = {1, 2, 5, 6, 90};
    EXPECT_EQ(covering_ranges(some, 2), (std::vector<IndexRange>{{1, 7}, {90, 91}}));
    EXPECT_EQ(covering_ranges(some, 9), (std::vector<IndexRange>{{1, 3}, {5, 7}, {90, 91}}));
    const std::uint32_t odd[] = {1, 3};
    EXPECT_EQ(covering_ranges(odd, 2), (std::vector<IndexRange>{{1, 2}, {3, 4}}));
}

TEST(CpuBackend, UnchangedPoseRefitsNoLeafAndChangedOnesOnlyWhatMoved) {
    const std::unique_ptr<Animation> animation = make_procedural("herd", 20000);
    const SceneSpace space(WorldBounds{{-12, -12, -12}, {12, 12, 12}});
    const auto pose_at = [&](double frame) {
        std::vector<vec3> at = positions_at(*animation, frame);
        space.to_scene(at, at);
        return at;
    };
    const Bvh built = build_bvh(animation->topology(), pose_at(0));
    Pose pose(pose_at(0));
    const auto partly = cpu::make_cpu_backend();
    const auto fully = cpu::make_cpu_backend();
    for (Backend* backend : {partly.get(), fully.get()})
        backend->set_scene(animation->topology(), pose, built);
    EXPECT_EQ(partly->refit(), 0u);
    EXPECT_EQ(tree_hash(*partly), bvh_hash(built));
    for (const double frame : {1.0, 2.0, 2.0, 7.5, 0.0}) {
        pose.move_to(pose_at(frame));
        // At least half of the triangles are ground, which never moves.
        EXPECT_LT(partly->refit(), built.leaves.size() * 6 / 10) << frame;
        EXPECT_EQ(fully->refit(RefitExtent::kAll), built.leaves.size());
        EXPECT_EQ(tree_hash(*partly), tree_hash(*fully)) << frame;
    }
}

TEST(CpuBackend, PartsAreThoseOfTheNewTreeAfterAnotherFrame) {
    const TestScene scene = torus(60, 30);
    const auto backend = cpu::make_cpu_backend();
    MovingScene moving(*backend, scene, build_bvh(scene.topology(), scene.positions()));
    std::vector<vec3> positions = scene.positions();
    positions[3].x += 0x1p12f;
    moving.refit(positions);
    std::vector<vec3> folded = scene.positions();
    for (vec3& p : folded) p.y = p.y < 0 ? -p.y : p.y;
    const Bvh rebuilt = build_bvh(scene.topology(), folded);
    moving.set_tree(folded, rebuilt);
    positions = folded;
    positions[500].z += 0x1p12f;
    EXPECT_LT(moving.refit(positions), rebuilt.leaves.size() / 4);
    Bvh expected = rebuilt;
    cpu::refit(expected, positions);
    EXPECT_EQ(tree_hash(*backend), bvh_hash(expected));
}

}  // namespace
}  // namespace mray
