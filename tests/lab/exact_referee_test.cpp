// The exact referee on cases with known answers, and the program's rule compared with the referee.
#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

#include "common/bvh/builder/bvh_builder.h"
#include "cpu/reference/scalar_tracer.h"
#include "lab/accuracy/chart_scene.h"
#include "lab/accuracy/exact_referee.h"
#include "tests/support/oracle.h"
#include "tests/support/test_scene.h"

namespace mray::test {
namespace {

using lab::ExactReferee;
using lab::Truth;
using lab::Verdict;

/// A scene with its tree and referee.
struct Court {
    explicit Court(TestScene of)
        : scene(std::move(of)),
          bvh(build_bvh(scene.topology(), scene.positions())),
          referee(scene.topology(), scene.positions(), bvh) {}

    Truth truth(const Ray& ray) const { return referee.closest(ray); }
    Verdict verdict(const Ray& ray, std::uint32_t prim_id) const {
        return referee.judge(ray, truth(ray), prim_id);
    }

    TestScene scene;
    Bvh bvh;
    ExactReferee referee;
};

Ray towards(vec3 org, vec3 dir) { return {org, 0, dir, kInfiniteT}; }

/// Two squares across the z axis, the second one farther away: triangles 0, 1 at z = -8, 2, 3 at z
/// = -16.
TestScene two_squares() {
    std::vector<vec3> positions;
    std::vector<uvec3> triangles;
    for (const float z : {-8.0f, -16.0f}) {
        const auto first = static_cast<std::uint32_t>(positions.size());
        for (const vec3 p : {vec3(-4, -4, z), vec3(4, -4, z), vec3(4, 4, z), vec3(-4, 4, z)})
            positions.push_back(p);
        triangles.push_back({first, first + 1, first + 2});
        triangles.push_back({first, first + 2, first + 3});
    }
    return {std::move(positions), std::move(triangles)};
}

/// From world space of two_squares to scene space.
Ray in_scene(const Court& court, vec3 org, vec3 dir) { return scene_ray(court.scene, org, dir); }

TEST(ExactReferee, FindsTheHitOfASimpleCase) {
    const Court court(two_squares());
    const Ray ray = in_scene(court, {1, -2, 0}, {0, 0, -1});
    EXPECT_EQ(court.truth(ray).prim_id, 0u);
    EXPECT_EQ(court.verdict(ray, 0), Verdict::kRight);
    EXPECT_EQ(court.verdict(ray, 2), Verdict::kWrongTriangle);
    EXPECT_EQ(court.verdict(ray, kNoPrim), Verdict::kFalseMiss);
    EXPECT_EQ(court.verdict(in_scene(court, {7, 0, 0}, {0, 0, -1}), 0), Verdict::kFalseHit);
    EXPECT_EQ(court.verdict(in_scene(court, {7, 0, 0}, {0, 0, -1}), kNoPrim), Verdict::kRight);
}

TEST(ExactReferee, AcceptsBothTrianglesOfAnEdgeAndCallsAMissALeak) {
    const Court court(two_squares());
    const Ray ray = in_scene(court, {1, 1, 0}, {0, 0, -1});
    EXPECT_EQ(court.truth(ray).prim_id, 0u);
    EXPECT_EQ(court.verdict(ray, 1), Verdict::kRight);
    EXPECT_EQ(court.verdict(ray, 2), Verdict::kLeak);
    EXPECT_EQ(court.verdict(ray, kNoPrim), Verdict::kLeak);
}

TEST(ExactReferee, ExcusesAMissBesideABoundaryEdgeButNotInsideTheSurface) {
    const Court court(two_squares());
    // The right edge of both squares: nothing beyond.
    const Ray edge = in_scene(court, {4, 1, 0}, {0, 0, -1});
    EXPECT_TRUE(court.truth(edge).hit());
    EXPECT_EQ(court.verdict(edge, kNoPrim), Verdict::kDisplaced);
    const Ray inside = in_scene(court, {3.99f, 1, 0}, {0, 0, -1});
    EXPECT_EQ(court.verdict(inside, kNoPrim), Verdict::kFalseMiss);
}

TEST(ExactReferee, DistinguishesRaysBeyondThePrecisionOfDoubles) {
    // The corners span 2^60 of the smallest step: the edge's sign needs more digits than a double.
    const vec3 a(-0x1p20f, -0x1p-40f, -0x1p20f);
    const vec3 b(0x1p20f, 0, -0x1p20f);
    const vec3 c(0, 0x1p20f, -0x1p20f);
    const lab::ExactTriangle through(towards({0, 0, 0}, {0, 0, -1}), a, b, c);
    EXPECT_TRUE(through.is_met());
    const lab::ExactTriangle beside(towards({0, -0x1p-40f, 0}, {0, 0, -1}), a, b, c);
    EXPECT_FALSE(beside.is_met());
    const lab::ExactTriangle on(towards({0x1p20f, 0, 0}, {0, 0, -1}), a, b, c);
    EXPECT_TRUE(on.is_met());
}

TEST(ExactReferee, OrdersPlanesThatDifferByLessThanAFloat) {
    const Ray ray = towards({0, 0, 0}, {0.25f, 0, -1});
    const vec3 b(2, 0, -1);
    const vec3 c(0, 2, -1);
    const lab::ExactTriangle near(ray, {-2, -2, -1}, b, c);
    const lab::ExactTriangle far(ray, {-2, -2, std::nextafter(-1.0f, -2.0f)}, b, c);
    const lab::ExactTriangle same(ray, {-2, -2, -1}, b, c);
    EXPECT_LT(near.compare_t(far), 0);
    EXPECT_GT(far.compare_t(near), 0);
    EXPECT_EQ(near.compare_t(same), 0);
}

TEST(ExactReferee, NeverHitsTrianglesWithoutAreaOrEdgeOn) {
    const Ray ray = towards({0, 0, 0}, {0, 0, -1});
    EXPECT_FALSE(lab::ExactTriangle(ray, {-1, 0, -1}, {0, 0, -1}, {1, 0, -1}).is_met());
    EXPECT_FALSE(lab::ExactTriangle(ray, {0, 0, -1}, {0, 0, -1}, {0, 0, -1}).is_met());
    EXPECT_FALSE(lab::ExactTriangle(ray, {0, -1, -1}, {0, 1, -1}, {0, 0, -2}).is_met());
}

// Lines beside a ray down the z axis: places are x, y; radii are lengths.
Ray down() { return towards({0, 0, 8}, {0, 0, -1}); }

TEST(ParallelView, FindsAStripBetweenLines) {
    lab::ParallelView view(down());
    view.add(1, {0.60f, -9, 0}, {0.61f, -9, 0}, {0.605f, 9, 0});
    EXPECT_TRUE(view.shows(1, 1, 4));
    EXPECT_FALSE(view.shows(1, 0.59, 4));
}

TEST(ParallelView, HidesTrianglesCoveredByMoreThanAFewUlps) {
    const vec3 a(-9, -9, 0), b(9, -9, 0), c(0, 9, 0);
    const auto raised = [](vec3 p, float z) { return vec3(p.x, p.y, z); };
    lab::ParallelView view(down());
    view.add(1, a, b, c);
    view.add(2, raised(a, 0x1p-19f), raised(b, 0x1p-19f), raised(c, 0x1p-19f));
    EXPECT_TRUE(view.shows(1, 1, 4));
    EXPECT_FALSE(view.shows(1, 1, 1));
    EXPECT_TRUE(view.shows(2, 1, 0));
    EXPECT_FALSE(view.shows(kNoPrim, 1, 4));
}

TEST(ParallelView, FindsAMissingBladeButNoGapInAFanAroundAVertex) {
    constexpr int kBlades = 97;
    const auto rim = [](int i) {
        const double angle = 2 * 3.14159265358979 * (i % kBlades) / kBlades;
        return vec3(static_cast<float>(4e5 * std::cos(angle)),
                    static_cast<float>(4e5 * std::sin(angle)), static_cast<float>(i % 3));
    };
    lab::ParallelView closed(down());
    lab::ParallelView open(down());
    for (int i = 0; i < kBlades; ++i) {
        closed.add(static_cast<std::uint32_t>(i), {0.1f, 0.2f, 0}, rim(i), rim(i + 1));
        if (i != 50) open.add(static_cast<std::uint32_t>(i), {0.1f, 0.2f, 0}, rim(i), rim(i + 1));
    }
    EXPECT_FALSE(closed.shows(kNoPrim, 1, 4));
    EXPECT_TRUE(open.shows(kNoPrim, 1, 4));
    EXPECT_FALSE(open.shows(50, 1, 4));
}

TEST(ParallelView, IgnoresTrianglesBehindTheOriginOrOutOfRange) {
    lab::ParallelView view({{0, 0, 8}, 2, {0, 0, -1}, 7});
    view.add(1, {-9, -9, 9}, {9, -9, 9}, {0, 9, 9});
    view.add(2, {-9, -9, 7}, {9, -9, 7}, {0, 9, 7});
    view.add(3, {-9, -9, 0}, {9, -9, 0}, {0, 9, 0});
    EXPECT_TRUE(view.shows(kNoPrim, 1, 4));
    for (const std::uint32_t prim_id : {1u, 2u, 3u}) EXPECT_FALSE(view.shows(prim_id, 1, 4));
}

TEST(ExactReferee, ClassifiesANeighbourAtTheSameDepthAsBeside) {
    const Court court(two_squares());
    // 2^-16 of its size from the diagonal, far more than a vertex is displaced by.
    const Ray ray = in_scene(court, {1, 0.9998f, 0}, {0, 0, -1});
    EXPECT_EQ(court.truth(ray).prim_id, 0u);
    EXPECT_EQ(court.verdict(ray, 1), Verdict::kBeside);
    EXPECT_FALSE(lab::is_wrong(Verdict::kBeside));
    EXPECT_EQ(court.verdict(in_scene(court, {1, -2, 0}, {0, 0, -1}), 1), Verdict::kWrongTriangle);
}

TEST(ExactReferee, AgreesWithASearchWithoutTheTree) {
    for (const NamedScene& named : adversarial_scenes()) {
        const Court court(named.scene);
        std::vector<std::uint32_t> all(named.scene.triangle_count());
        std::iota(all.begin(), all.end(), 0u);
        for (const Ray& ray : mixed_rays(named.scene, 60, 11))
            EXPECT_EQ(court.referee.closest(ray), court.referee.closest_of(ray, all)) << named.name;
    }
}

TEST(ExactReferee, AgreesWithTheOracleWhereTheOracleIsSure) {
    const Court court(icosphere(3));
    for (const Ray& ray : mixed_rays(court.scene, 2000, 12)) {
        const OracleHit oracle = oracle_intersect(court.scene, ray);
        if (oracle.ambiguous) continue;
        const Truth truth = court.truth(ray);
        ASSERT_EQ(truth.hit(), oracle.hit);
        if (oracle.hit) {
            EXPECT_EQ(truth.prim_id, oracle.prim_id);
            EXPECT_NEAR(truth.t, static_cast<double>(oracle.t), 1e-12 * truth.t);
        }
    }
}

TEST(HitRule, IsNeverWrongOnOrdinaryClosedMeshes) {
    for (const TestScene& scene : {icosphere(4), torus(64, 32), grid_box(16), star(3, 5)}) {
        const Court court(scene);
        const cpu::ScalarTracer tracer(court.bvh);
        for (const Ray& ray : mixed_rays(court.scene, 20000, 13)) {
            const Verdict verdict = court.verdict(ray, tracer.intersect(ray).prim_id);
            EXPECT_LT(verdict, Verdict::kBeside);
        }
    }
}

/// Rays from anywhere around a scene at its vertices, edges and faces.
std::vector<Ray> aimed_rays(const TestScene& scene, std::size_t count, std::uint64_t seed) {
    Random random(seed);
    std::vector<Ray> rays;
    while (rays.size() < count) {
        const uvec3 t =
            scene.topology()
                .triangles[random.below(static_cast<std::uint32_t>(scene.triangle_count()))];
        const vec3 a = scene.positions()[t.x];
        const auto f = static_cast<float>(random.real(0, 1));
        const auto g = static_cast<float>(random.real(0, 1)) * (1 - f);
        const vec3 along = (scene.positions()[t.y] - a) * (rays.size() % 3 > 0 ? f : 0);
        const vec3 across = (scene.positions()[t.z] - a) * (rays.size() % 3 > 1 ? g : 0);
        const vec3 org = snap_point(random.point(kSceneExtent));
        const vec3 dir = a + along + across - org;
        if (dir != vec3(0, 0, 0)) rays.push_back(towards(org, canonical_direction(dir)));
    }
    return rays;
}

/// Compares the scalar tracer's answers to `count` rays with the referee.
void expect_never_wrong(const TestScene& scene, const std::string& name, std::size_t count) {
    const Court court(scene);
    const cpu::ScalarTracer tracer(court.bvh);
    std::size_t wrong = 0;
    for (const Ray& ray : aimed_rays(court.scene, count, 17)) {
        const bool is_wrong = lab::is_wrong(court.verdict(ray, tracer.intersect(ray).prim_id));
        wrong += is_wrong ? 1 : 0;
        EXPECT_FALSE(is_wrong) << name;
        if (wrong == 3) return;
    }
}

TEST(HitRule, IsNeverWrongOnFailureScenes) {
    for (const lab::ChartInput& one : lab::failure_scenes()) {
        // From far away one ulp of t is larger than the detail's triangles
        // (docs/guide/crosscheck.md).
        if (one.name == "detail 1 in 1e6") continue;
        expect_never_wrong(TestScene(one.positions, one.topology.triangles), one.name, 10000);
    }
}

}  // namespace
}  // namespace mray::test
