#include "tests/support/motion_checks.h"

#include <gtest/gtest.h>

#include "common/bvh/builder/bvh_builder.h"
#include "common/interop/arithmetic.h"
#include "common/update/tree_updater.h"
#include "tests/support/backend_results.h"
#include "tests/support/same_bits.h"
#include "tests/support/test_scene.h"
#include "tests/support/tree_check.h"

namespace mray::test {
namespace {

// Enough to meet every leaf of some hundred triangles from several sides.
constexpr int kRays = 300;

/// From all around and within, at vertices: edges and corners are what goes wrong first.
std::vector<Ray> rays_at(const Motion& motion, std::size_t pose) {
    Random random(pose);
    std::vector<Ray> rays;
    const std::vector<vec3>& positions = motion.poses[pose];
    while (rays.size() < kRays) {
        const vec3 org = snap_point(random.point(0.9 * kSceneExtent));
        const vec3 target =
            random.pick(positions) + random.point(rays.size() % 3 == 0 ? 0 : 0.01 * kSceneExtent);
        rays.push_back({org, 0, canonical_direction(target - org), 4 * kSceneExtent});
    }
    return rays;
}

std::vector<Hit> hits_of(Backend& backend, const std::vector<Ray>& rays) {
    std::vector<Hit> hits(rays.size());
    backend.trace({rays, hits});
    return hits;
}

std::size_t different(const std::vector<Hit>& a, const std::vector<Hit>& b) {
    std::size_t count = 0;
    for (std::size_t i = 0; i < a.size(); ++i) count += same_bits(a[i], b[i]) ? 0 : 1;
    return count;
}

}  // namespace

void expect_hits_of_brute_force(const Motion& motion, Backend& tracer, Backend& brute) {
    const std::vector<vec3>& start = motion.poses[motion.build_at];
    for (const char* policy : {"refit", "rebuild", "every:3", "auto"}) {
        // A budget that sends some builds in the background.
        const UpdateConfig config{.deterministic = true, .budget = 0.02};
        Pose moving(start);
        brute.set_scene(motion.topology, moving, build_bvh(motion.topology, start));
        TreeUpdater updater(motion.topology, moving, tracer,
                            make_update_policy(parse_policy(policy), config), {}, config);
        for (std::size_t pose = 0; pose < motion.poses.size(); ++pose) {
            const std::vector<vec3>& positions = motion.poses[pose];
            moving.move_to(positions);
            updater.update();
            brute.refit();
            const std::vector<Ray> rays = rays_at(motion, pose);
            ASSERT_EQ(different(hits_of(tracer, rays), hits_of(brute, rays)), 0u)
                << motion.name << ", " << policy << ", pose " << pose;
            updater.frame_done({0, rays.size()});
            ASSERT_EQ(check_bvh(tree_of(tracer), motion.topology, positions),
                      std::vector<std::string>{})
                << motion.name << ", " << policy << ", pose " << pose;
        }
    }
}

std::vector<std::string> counted_decisions(const Motion& motion, Backend& tracer) {
    const UpdateConfig config{.deterministic = true, .budget = 0.02};
    Pose moving(motion.poses[motion.build_at]);
    TreeUpdater updater(motion.topology, moving, tracer,
                        make_update_policy({PolicyKind::kAuto}, config), {}, config);
    std::vector<std::string> decisions;
    for (std::size_t pose = 0; pose < motion.poses.size(); ++pose) {
        moving.move_to(motion.poses[pose]);
        updater.update();
        const std::vector<Ray> rays = rays_at(motion, pose);
        hits_of(tracer, rays);
        updater.frame_done({0, rays.size()});
        decisions.push_back(name_of(updater.last().step) + (", " + updater.last().reason) + ", " +
                            std::to_string(tree_hash(tracer)));
    }
    return decisions;
}

}  // namespace mray::test
