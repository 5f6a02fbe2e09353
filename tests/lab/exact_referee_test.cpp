// The exact referee on cases with known answers, and the program's rule compared with the referee.
#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

#include "common/bvh/builder/bvh_builder.h"
#include "cpu/reference/scalar_tracer.h"
#include "lab/accuracy/exact_referee.h"
#include "tests/support/test_scene.h"

namespace mray::test {
namespace {

using lab::ExactReferee;
using lab::Truth;
using lab::Verdict;

/// A scene with its referee.
struct Court {
    explicit Court(TestScene of)
        : scene(std::move(of)),
          tree(lab::build_peer_tree(scene.topology(), scene.positions())),
          referee(scene.topology(), scene.positions(), tree) {}

    Truth truth(const Ray& ray) const { return referee.closest(ray); }
    Verdict verdict(const Ray& ray, std::uint32_t prim_id) const {
        return referee.judge(ray, truth(ray), prim_id);
    }

    TestScene scene;
    lab::PeerTree tree;
    ExactReferee referee;
};

Ray towards(vec3 org, vec3 dir) { return {org, 0, dir, kInfiniteT}; }

/// Two squares across the z axis, the second one farther away: triangles 0, 1 at z = -8, 2, 3 at z
/// = -16.
TestScene two_squares() {
    return {{{-4, -4, -8},
             {4, -4, -8},
             {4, 4, -8},
             {-4, 4, -8},
             {-4, -4, -16},
             {4, -4, -16},
             {4, 4, -16},
             {-4, 4, -16}},
            {{0, 1, 2}, {0, 2, 3}, {4, 5, 6}, {4, 6, 7}}};
}

TEST(ExactReferee, FindsTheHitOfASimpleCase) {
    const Court court(two_squares());
    const Ray ray = scene_ray(court.scene, {1, -2, 0}, {0, 0, -1});
    EXPECT_EQ(court.truth(ray).prim_id, 0u);
    EXPECT_EQ(court.verdict(ray, 0), Verdict::kRight);
    EXPECT_EQ(court.verdict(ray, 2), Verdict::kWrongTriangle);
    EXPECT_EQ(court.verdict(ray, kNoPrim), Verdict::kFalseMiss);
    EXPECT_EQ(court.verdict(scene_ray(court.scene, {7, 0, 0}, {0, 0, -1}), 0), Verdict::kFalseHit);
    EXPECT_EQ(court.verdict(scene_ray(court.scene, {7, 0, 0}, {0, 0, -1}), kNoPrim),
              Verdict::kRight);
}

TEST(ExactReferee, AcceptsBothTrianglesOfAnEdgeAndCallsAMissALeak) {
    const Court court(two_squares());
    const Ray ray = scene_ray(court.scene, {1, 1, 0}, {0, 0, -1});
    EXPECT_EQ(court.truth(ray).prim_id, 0u);
    EXPECT_EQ(court.verdict(ray, 1), Verdict::kRight);
    EXPECT_EQ(court.verdict(ray, 2), Verdict::kLeak);
    EXPECT_EQ(court.verdict(ray, kNoPrim), Verdict::kLeak);
}

TEST(ExactReferee, ExcusesAMissBesideABoundaryEdgeButNotInsideTheSurface) {
    const Court court(two_squares());
    // The right edge of both squares: nothing beyond.
    const Ray edge = scene_ray(court.scene, {4, 1, 0}, {0, 0, -1});
    EXPECT_TRUE(court.truth(edge).hit());
    EXPECT_EQ(court.verdict(edge, kNoPrim), Verdict::kDisplaced);
    const Ray inside = scene_ray(court.scene, {3.99f, 1, 0}, {0, 0, -1});
    EXPECT_EQ(court.verdict(inside, kNoPrim), Verdict::kFalseMiss);
}

TEST(ExactReferee, JudgesOcclusion) {
    const Court court(two_squares());
    const auto verdict = [&](vec3 org, bool occluded, float tfar = kInfiniteT) {
        Ray ray = scene_ray(court.scene, org, {0, 0, -1});
        ray.tfar = tfar;
        return court.referee.judge_occlusion(ray, court.truth(ray), occluded);
    };
    EXPECT_EQ(verdict({1, -2, 0}, true), Verdict::kRight);
    EXPECT_EQ(verdict({1, -2, 0}, false), Verdict::kFalseMiss);
    EXPECT_EQ(verdict({1, 1, 0}, false), Verdict::kLeak);
    EXPECT_EQ(verdict({7, 0, 0}, false), Verdict::kRight);
    EXPECT_EQ(verdict({7, 0, 0}, true), Verdict::kFalseHit);
    // The boundary edge, where either answer will do.
    EXPECT_EQ(verdict({4, 1, 0}, false), Verdict::kDisplaced);
    // A range that ends at the first square, to some ulp, and one before it.
    const float t =
        static_cast<float>(court.truth(scene_ray(court.scene, {1, -2, 0}, {0, 0, -1})).t);
    EXPECT_EQ(verdict({1, -2, 0}, true, std::nextafter(t, 0.0f)), Verdict::kClose);
    EXPECT_EQ(verdict({1, -2, 0}, false, std::nextafter(t, INFINITY)), Verdict::kClose);
    EXPECT_EQ(verdict({1, -2, 0}, false, 1), Verdict::kRight);
    EXPECT_EQ(verdict({1, -2, 0}, true, 1), Verdict::kFalseHit);
}

TEST(ExactReferee, MeasuresHowFarAHitIsOff) {
    const std::vector<vec3> positions = {{-3, -3, -1.5f}, {5, -3, -1.5f}, {-3, 5, -1.5f}};
    const Topology topology = TestScene(positions, {{0, 1, 2}}).topology();
    const lab::PeerTree tree = lab::build_peer_tree(topology, positions);
    const ExactReferee referee(topology, positions, tree);
    const Ray ray = towards({-1, -2, 0}, {0, 0, -1});
    const float up = std::nextafter(1.5f, 2.0f);
    const auto expect = [&](const Hit& hit, double t, double u, double v) {
        EXPECT_EQ(referee.errors(ray, hit), (std::array{t, u, v}));
    };
    expect({1.5f, 0.25f, 0.125f, 0}, 0, 0, 0);
    expect({up, 0.25f, 0.125f, 0}, 1, 0, 0);
    expect({1.5f, 0.25f + 0x1p-22f, 0.125f - 0x1p-25f, 0}, 0, 2, 0.25);
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
    const Ray ray = scene_ray(court.scene, {1, 0.9998f, 0}, {0, 0, -1});
    EXPECT_EQ(court.truth(ray).prim_id, 0u);
    EXPECT_EQ(court.verdict(ray, 1), Verdict::kBeside);
    EXPECT_FALSE(lab::is_wrong(Verdict::kBeside));
    EXPECT_EQ(court.verdict(scene_ray(court.scene, {1, -2, 0}, {0, 0, -1}), 1),
              Verdict::kWrongTriangle);
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

TEST(HitRule, IsNeverWrongOnOrdinaryClosedMeshes) {
    for (const TestScene& scene : {icosphere(4), torus(64, 32), grid_box(16), star(3, 5)}) {
        const Court court(scene);
        const Bvh bvh = build_bvh(court.scene.topology(), court.scene.positions());
        const cpu::ScalarTracer tracer(bvh);
        for (const Ray& ray : mixed_rays(court.scene, 20000, 13)) {
            const Verdict verdict = court.verdict(ray, tracer.intersect(ray).prim_id);
            EXPECT_LT(verdict, Verdict::kBeside);
        }
    }
}

TEST(HitRule, IsNeverWrongOnAnySceneAboutTrianglesThatAreNotGrazed) {
    for (const NamedScene& named : adversarial_scenes()) {
        SCOPED_TRACE(named.name);
        const Court court(named.scene);
        const std::vector<vec3>& p = court.scene.positions();
        const cpu::BruteTracer brute(court.scene.topology(), p);
        for (const Ray& ray : mixed_rays(court.scene, 400, 31)) {
            const auto is_grazed = [&](std::uint32_t prim_id) {
                if (prim_id == kNoPrim) return false;
                const uvec3 t = court.scene.topology().triangles[prim_id];
                return lab::ExactTriangle(ray, p[t.x], p[t.y], p[t.z]).edge_distance() <= 1e-6;
            };
            const Hit hit = brute.intersect(ray);
            const Truth truth = court.truth(ray);
            EXPECT_TRUE(!lab::is_wrong(court.referee.judge(ray, truth, hit.prim_id)) ||
                        is_grazed(hit.prim_id) || is_grazed(truth.prim_id));
            if (hit.prim_id != truth.prim_id) continue;
            // Rounding of t, and of the z of a triangle that reaches to both sides of the origin.
            EXPECT_NEAR(hit.t, truth.t, 1e-5 * truth.t + 1e-6 * kSceneExtent);
        }
    }
}

}  // namespace
}  // namespace mray::test
