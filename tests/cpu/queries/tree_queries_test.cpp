#include "cpu/queries/tree_queries.h"

#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "common/bvh/builder/bvh_builder.h"
#include "common/bvh/exact_closest.h"
#include "common/interop/arithmetic.h"
#include "cpu/reference/scalar_tracer.h"
#include "tests/support/places.h"
#include "tests/support/query_answers.h"
#include "tests/support/test_scene.h"

namespace mray::test {
namespace {

constexpr std::uint32_t kAllHits = std::numeric_limits<std::uint32_t>::max();

/// Groups of 16 points at and around special ones.
std::vector<vec3> grouped_points(const TestScene& scene, std::size_t groups) {
    Random random(11);
    const Surroundings around(scene.world_positions(), scene.topology().triangles);
    std::vector<vec3> points;
    for (const vec3& p : point_groups(random, around, groups, 16)) {
        const vec3 point = scene.space().to_scene(p);
        points.push_back(largest_component(point) <= kSceneExtent ? point : vec3(0));
    }
    return points;
}

/// Questions about rays and points near each other. The last vector of points is not full, and
/// floats cannot decide about its last point.
Questions grouped_questions(const TestScene& scene, const cpu::BruteTracer& brute) {
    Questions q;
    q.points = grouped_points(scene, 30);
    q.points.resize(q.points.size() - 3);
    if (!scene.positions().empty()) q.points.back() = scene.positions().front();
    q.reach = 1;
    // From one place each to a group of points.
    q.rays = mixed_rays(scene, q.points.size(), 13);
    for (std::size_t i = 0; i < q.rays.size(); ++i) {
        Ray& ray = q.rays[i];
        ray.org = q.rays[i - i % 48].org;
        const vec3 dir = snap_point(q.points[i]) - ray.org;
        if (dir != vec3(0, 0, 0)) ray.dir = canonical_direction(dir);
        ray.tfar = i % 4 == 0 ? ray.tnear : kInfiniteT;
        // Some end at their first hit, or just before it.
        const Hit hit = brute.intersect(ray);
        if (hit.prim_id != kNoPrim && i % 3 != 0)
            ray.tfar = i % 3 == 1 ? hit.t : std::nextafter(hit.t, 0.0f);
    }
    q.after.resize(q.rays.size());
    return q;
}

class TreeQueriesOn : public testing::TestWithParam<std::size_t> {};

TEST_P(TreeQueriesOn, HaveTheBitsOfBruteForceOnEveryTarget) {
    const NamedScene named = adversarial_scenes()[GetParam()];
    const TestScene& scene = named.scene;
    const Bvh bvh = build_bvh(scene.topology(), scene.positions());
    const cpu::BruteTracer brute(scene.topology(), scene.positions());
    for (const auto& [crossing, most] :
         {std::pair(Crossing::kEach, kAllHits), {Crossing::kOwner, 2u}}) {
        for (const Questions& questions :
             {mixed_questions(scene, brute, crossing, 250, 5), grouped_questions(scene, brute)}) {
            const Answers expected = answers_of(brute, questions, crossing, most);
            for (const SimdTarget& target : supported_simd_targets()) {
                const cpu::TreeQueries tree(bvh, target);
                const Answers found = answers_of(tree, questions, crossing, most);
                EXPECT_EQ(count_differences(found, expected), 0u)
                    << named.name << ", " << target.name << ", " << most;
            }
        }
    }
}
INSTANTIATE_TEST_SUITE_P(Scene, TreeQueriesOn,
                         testing::Range(std::size_t{0}, adversarial_scenes().size()));

TEST(TreeQueries, EndAtTheRayOrPointAtWhichTheyAreCancelled) {
    const TestScene scene = adversarial_scenes().front().scene;
    const Bvh bvh = build_bvh(scene.topology(), scene.positions());
    const cpu::BruteTracer brute(scene.topology(), scene.positions());
    const cpu::TreeQueries tree(bvh, best_simd_target());
    const std::atomic<bool> cancel = true;
    const Watch watch(&cancel);
    const std::vector<Ray> rays(100);
    const std::vector<vec3> points(300);
    std::vector<std::uint64_t> counts(rays.size());
    HitLists lists;
    std::vector<FloatWinding> windings(points.size());
    std::vector<UncertainCrossing> uncertain;
    std::vector<ClosestTriangle> closest(points.size());
    const QueryBatch batches[] = {CountQuery{rays, Crossing::kEach, counts, watch},
                                  ListQuery{rays, Crossing::kEach, kAllHits, lists, watch},
                                  WindingQuery{points, windings, uncertain, watch},
                                  ClosestQuery{points, kAnyDistance2, closest, watch}};
    for (const QueryBatch& batch : batches) {
        EXPECT_THROW(brute(batch), Error) << batch.index();
        EXPECT_THROW(tree(batch), Error) << batch.index();
    }
}

TEST(TreeQueries, FindTheExactlyClosestTriangleOnEveryTarget) {
    for (const NamedScene& named : adversarial_scenes()) {
        const TestScene& scene = named.scene;
        const Bvh bvh = build_bvh(scene.topology(), scene.positions());
        for (const std::size_t groups : {std::size_t{20}, std::size_t{6}}) {
            const std::vector<vec3> points = grouped_points(scene, groups);
            std::vector<std::uint32_t> expected;
            for (const vec3& p : points) expected.push_back(exact_closest(bvh, dvec3(p)).prim_id);
            const std::vector<dvec3> exact(points.begin(), points.end());
            std::vector<NumberedTriangle> found(points.size());
            const ExactClosestQuery query{points, exact, kAnyDistance2, found};
            const auto expect_found = [&] {
                for (std::size_t i = 0; i < points.size(); ++i)
                    ASSERT_EQ(found[i].prim_id, expected[i]) << i;
            };
            cpu::BruteTracer(scene.topology(), scene.positions())(query);
            expect_found();
            for (const SimdTarget& target : supported_simd_targets()) {
                SCOPED_TRACE(std::string(named.name) + ", " + target.name);
                cpu::TreeQueries(bvh, target)(query);
                expect_found();
            }
        }
    }
}

}  // namespace
}  // namespace mray::test
