#include "cpu/queries/tree_queries.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "common/bvh/builder/bvh_builder.h"
#include "cpu/reference/brute_queries.h"
#include "cpu/refit/refit.h"
#include "tests/support/closed_poses.h"
#include "tests/support/mixed_points.h"
#include "tests/support/same_bits.h"
#include "tests/support/test_scene.h"

namespace mray::test {
namespace {

constexpr float kAnyDistance = 0x1p+90f;

/// The answers of a scene's queries to some rays and points.
struct Answers {
    std::vector<std::uint64_t> counts;
    HitLists lists;
    std::vector<Hit> next;
    std::vector<PointWinding> windings;
    std::vector<ClosestTriangle> closest;
    std::vector<ClosestTriangle> near;
};

Answers answers_of(const SceneQueries& queries, const std::vector<Ray>& rays,
                   const std::vector<HitCursor>& after, const std::vector<vec3>& points,
                   Crossing crossing, std::uint32_t most) {
    Answers a;
    a.counts.resize(rays.size());
    queries.count(rays, crossing, a.counts);
    queries.list(rays, crossing, most, a.lists);
    a.next.resize(rays.size());
    queries.intersect_after(rays, after, crossing, a.next);
    a.windings.resize(points.size());
    queries.wind(points, a.windings);
    a.closest.resize(points.size());
    queries.closest(points, kAnyDistance, a.closest);
    a.near.resize(points.size());
    queries.closest(points, 0x1p+34f, a.near);
    return a;
}

/// The number of answers that differ.
std::size_t count_differences(const Answers& a, const Answers& b) {
    std::size_t different = 0;
    for (std::size_t i = 0; i < a.counts.size(); ++i) {
        different += a.counts[i] != b.counts[i];
        different += a.lists.listed[i] != b.lists.listed[i] || a.lists.total[i] != b.lists.total[i];
        different += !same_bits(a.next[i], b.next[i]);
    }
    different += a.lists.hits.size() != b.lists.hits.size();
    for (std::size_t i = 0; i < std::min(a.lists.hits.size(), b.lists.hits.size()); ++i)
        different += !same_bits(a.lists.hits[i], b.lists.hits[i]);
    for (std::size_t i = 0; i < a.windings.size(); ++i) {
        different += a.windings[i] != b.windings[i];
        different += a.closest[i] != b.closest[i];
        different += a.near[i] != b.near[i];
    }
    return different;
}

/// Cursors at hits, and between them.
std::vector<HitCursor> cursors_for(const SceneQueries& queries, const std::vector<Ray>& rays,
                                   Crossing crossing) {
    std::vector<HitCursor> after(rays.size());
    std::vector<Hit> hits(rays.size());
    for (int step = 0; step < 3; ++step) {
        queries.intersect_after(rays, after, crossing, hits);
        for (std::size_t i = static_cast<std::size_t>(step); i < rays.size(); i += 3)
            if (hits[i].prim_id != kNoPrim) after[i] = {hits[i].t, hits[i].prim_id};
    }
    return after;
}

class TreeQueriesOn : public testing::TestWithParam<SimdTarget> {};
INSTANTIATE_TEST_SUITE_P(Targets, TreeQueriesOn, testing::ValuesIn(supported_simd_targets()),
                         [](const auto& parameter) { return std::string(parameter.param.name); });

TEST_P(TreeQueriesOn, AnswersWithTheBitsOfBruteForce) {
    for (const NamedScene& named : adversarial_scenes()) {
        const TestScene& scene = named.scene;
        const Bvh bvh = build_bvh(scene.topology(), scene.positions());
        const cpu::BruteQueries brute(scene.topology(), scene.positions());
        const cpu::TreeQueries tree(bvh, GetParam());
        const std::vector<Ray> rays = mixed_rays(scene, 400, 5);
        const std::vector<vec3> points =
            mixed_points(scene.topology().triangles, scene.positions(), 600, 6);
        for (const Crossing crossing : {Crossing::kEach, Crossing::kOwner}) {
            const std::vector<HitCursor> after = cursors_for(tree, rays, crossing);
            for (const std::uint32_t most : {1u, 3u, std::numeric_limits<std::uint32_t>::max()}) {
                const Answers expected = answers_of(brute, rays, after, points, crossing, most);
                const Answers found = answers_of(tree, rays, after, points, crossing, most);
                EXPECT_EQ(count_differences(found, expected), 0u) << named.name << ", " << most;
            }
        }
    }
}

}  // namespace
}  // namespace mray::test
