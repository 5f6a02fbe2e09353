#include "cpu/queries/tree_queries.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <vector>

#include "common/bvh/builder/bvh_builder.h"
#include "common/bvh/exact_closest.h"
#include "common/interop/arithmetic.h"
#include "cpu/reference/scalar_tracer.h"
#include "tests/support/query_answers.h"
#include "tests/support/test_scene.h"

namespace mray::test {
namespace {

constexpr std::uint32_t kAllHits = std::numeric_limits<std::uint32_t>::max();

TEST(TreeQueries, HaveTheBitsOfBruteForceOnEveryTarget) {
    for (const NamedScene& named : adversarial_scenes()) {
        const TestScene& scene = named.scene;
        const Bvh bvh = build_bvh(scene.topology(), scene.positions());
        const cpu::BruteTracer brute(scene.topology(), scene.positions());
        for (const Crossing crossing : {Crossing::kEach, Crossing::kOwner}) {
            const Questions questions = mixed_questions(scene, brute, crossing, 250, 5);
            for (const std::uint32_t most : {2u, kAllHits}) {
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
}

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

/// Groups of 16 points within some ulp, or within parts of the scene, of mixed points.
std::vector<vec3> grouped_points(const TestScene& scene, std::size_t groups) {
    Random random(11);
    std::vector<vec3> points;
    for (const vec3& centre : mixed_points(scene, groups, 7)) {
        const double size = std::ldexp(1.0, -static_cast<int>(random.below(40)));
        for (int i = 0; i < 16; ++i) {
            vec3 p;
            for (int axis = 0; axis < 3; ++axis) {
                const double extent = std::abs(static_cast<double>(centre[axis])) + 1;
                p[axis] = static_cast<float>(static_cast<double>(centre[axis]) +
                                             extent * size * random.real(-1, 1));
            }
            points.push_back(p);
        }
    }
    return points;
}

TEST(TreeQueries, AnswerAboutPointsNearEachOtherAsBruteForceOnEveryTarget) {
    for (const NamedScene& named : adversarial_scenes()) {
        const TestScene& scene = named.scene;
        const Bvh bvh = build_bvh(scene.topology(), scene.positions());
        std::vector<vec3> points = grouped_points(scene, 50);
        // The last vector of points is not full, and floats cannot decide about its points.
        points.resize(points.size() - 3);
        if (!scene.positions().empty()) points.back() = scene.positions().front();
        const cpu::BruteTracer brute(scene.topology(), scene.positions());
        std::vector<FloatWinding> expected_windings(points.size());
        std::vector<UncertainCrossing> expected_uncertain;
        brute(WindingQuery{points, expected_windings, expected_uncertain});
        std::sort(expected_uncertain.begin(), expected_uncertain.end());
        for (const SimdTarget& target : supported_simd_targets()) {
            std::vector<FloatWinding> windings(points.size());
            std::vector<UncertainCrossing> uncertain;
            cpu::TreeQueries(bvh, target)(WindingQuery{points, windings, uncertain});
            std::sort(uncertain.begin(), uncertain.end());
            EXPECT_TRUE(windings == expected_windings) << named.name << ", " << target.name;
            EXPECT_TRUE(uncertain == expected_uncertain) << named.name << ", " << target.name;
        }
        for (const float most_d2 : {kAnyDistance2, 1.0f}) {
            std::vector<ClosestTriangle> expected(points.size());
            brute(ClosestQuery{points, most_d2, expected});
            for (const SimdTarget& target : supported_simd_targets()) {
                std::vector<ClosestTriangle> found(points.size());
                cpu::TreeQueries(bvh, target)(ClosestQuery{points, most_d2, found});
                EXPECT_TRUE(found == expected) << named.name << ", " << target.name;
            }
        }
    }
}

/// Expects that rivals of points have the triangles that are exactly closest.
void expect_closest_among(const Rivals& rivals, const std::vector<vec3>& points,
                          const std::vector<std::uint32_t>& closest) {
    ASSERT_EQ(rivals.ends.size(), points.size());
    std::size_t first = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
        const auto own = std::span(rivals.triangles).subspan(first, rivals.ends[i] - first);
        first = rivals.ends[i];
        ASSERT_EQ(own.empty(), closest[i] == kNoPrim) << i;
        if (own.empty() || own.front().prim_id == kNoPrim) continue;
        ASSERT_EQ(exact_closest(dvec3(points[i]), own).prim_id, closest[i]) << i;
    }
}

TEST(TreeQueries, FindTheExactlyClosestTriangleAmongRivalsOnEveryTarget) {
    for (const NamedScene& named : adversarial_scenes()) {
        const TestScene& scene = named.scene;
        const Bvh bvh = build_bvh(scene.topology(), scene.positions());
        for (const std::size_t groups : {std::size_t{20}, std::size_t{6}}) {
            const std::vector<vec3> points = grouped_points(scene, groups);
            std::vector<std::uint32_t> closest;
            for (const vec3& p : points) closest.push_back(exact_closest(bvh, dvec3(p)).prim_id);
            std::vector<ClosestTriangle> found(points.size());
            Rivals of_brute;
            cpu::BruteTracer(scene.topology(), scene.positions())(
                ClosestQuery{points, kAnyDistance2, found, {}, &of_brute});
            expect_closest_among(of_brute, points, closest);
            for (const SimdTarget& target : supported_simd_targets()) {
                SCOPED_TRACE(std::string(named.name) + ", " + target.name);
                Rivals rivals;
                cpu::TreeQueries(bvh,
                                 target)(ClosestQuery{points, kAnyDistance2, found, {}, &rivals});
                expect_closest_among(rivals, points, closest);
            }
        }
    }
}

TEST(TreeQueries, CountHitsOfRaysNearEachOtherAsBruteForceOnEveryTarget) {
    for (const NamedScene& named : adversarial_scenes()) {
        const TestScene& scene = named.scene;
        const Bvh bvh = build_bvh(scene.topology(), scene.positions());
        const cpu::BruteTracer brute(scene.topology(), scene.positions());
        // From one place each to a group of points.
        const std::vector<vec3> points = grouped_points(scene, 60);
        std::vector<Ray> rays = mixed_rays(scene, points.size(), 13);
        for (std::size_t i = 0; i < rays.size(); ++i) {
            rays[i].org = rays[i - i % 48].org;
            const vec3 dir = snap_point(points[i]) - rays[i].org;
            if (dir != vec3(0, 0, 0)) rays[i].dir = canonical_direction(dir);
            rays[i].tfar = i % 4 == 0 ? rays[i].tnear : kInfiniteT;
        }
        // Some end at their first hit, or just before it.
        std::vector<Hit> first(rays.size());
        const std::vector<HitCursor> before(rays.size());
        brute(NextQuery{rays, before, Crossing::kEach, first});
        for (std::size_t i = 0; i < rays.size(); ++i) {
            if (first[i].prim_id == kNoPrim || i % 3 == 0) continue;
            rays[i].tfar = i % 3 == 1 ? first[i].t : std::nextafter(first[i].t, 0.0f);
        }
        for (const Crossing crossing : {Crossing::kEach, Crossing::kOwner}) {
            std::vector<std::uint64_t> expected(rays.size());
            brute(CountQuery{rays, crossing, expected});
            for (const SimdTarget& target : supported_simd_targets()) {
                std::vector<std::uint64_t> counts(rays.size());
                cpu::TreeQueries(bvh, target)(CountQuery{rays, crossing, counts});
                EXPECT_EQ(counts, expected) << named.name << ", " << target.name;
            }
        }
    }
}

}  // namespace
}  // namespace mray::test
