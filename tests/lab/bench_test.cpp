// What the benchmark traces and queries, and the tracer of 2007, whose arithmetic is its own.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <set>
#include <tuple>
#include <vector>

#include "common/bvh/box.h"
#include "common/bvh/builder/bvh_builder.h"
#include "common/interop/closest_rule.h"
#include "common/scene/camera_setup.h"
#include "lab/bench/bench_scene.h"
#include "lab/methods/closest_point.h"
#include "lab/methods/paper_2007.h"
#include "lab/methods/tracers.h"
#include "tests/support/test_scene.h"

namespace mray::test {
namespace {

using namespace lab;

/// The camera rays of a square image of a scene.
RaySet camera_rays_of(const TestScene& scene, const ViewSpec& view) {
    return make_primary_rays(
        make_image_params(view, bounds_of(scene.world_positions()), scene.space()));
}

/// How many active rays hit something.
std::size_t count_hits(const RaySet& set, const TraceAnswers& answers) {
    std::size_t count = 0;
    for (std::size_t i = 0; i < set.rays.size(); ++i) {
        if (set.active[i] == 0) continue;
        count += set.any_hit() ? answers.occluded[i] : answers.hits[i].prim_id != kNoPrim;
    }
    return count;
}

double hit_share(const TestScene& scene, const Bvh& bvh, ViewSpec view) {
    view.width = view.height = 128;
    const RaySet set = camera_rays_of(scene, view);
    const std::size_t hits = count_hits(set, trace_all(reference_tracer(bvh, set), set));
    return static_cast<double>(hits) / static_cast<double>(set.rays.size());
}

TEST(FillView, FillsTheImageWithTheScene) {
    for (const TestScene& scene : {icosphere(3), torus(24, 12), grid_box(4), star(4, 1)}) {
        const Bvh bvh = build_bvh(scene.topology(), scene.positions());
        const WorldBounds bounds = bounds_of(scene.world_positions());
        const ViewSpec view = fill_view({}, bounds, scene.space(), bvh);
        EXPECT_LT(hit_share(scene, bvh, {}), 0.8);
        // Turning the camera and other pixels shift some edge of the window.
        EXPECT_GT(hit_share(scene, bvh, view), kFullShare - 0.03);
        EXPECT_EQ(*view.eye, resolve_view({}, bounds).eye);
        EXPECT_EQ(*view.light, resolve_view({}, bounds).light);
    }
}

TEST(FillView, AcceptsEveryScene) {
    for (const NamedScene& named : adversarial_scenes()) {
        const TestScene& scene = named.scene;
        const Bvh bvh = build_bvh(scene.topology(), scene.positions());
        const WorldBounds bounds = bounds_of(scene.world_positions());
        const ViewSpec view = fill_view({}, bounds, scene.space(), bvh);
        EXPECT_NO_THROW(make_image_params(view, bounds, scene.space())) << named.name;
        EXPECT_GE(view.fov, ViewSpec{}.fov / (2 * kMaxZoom)) << named.name;
    }
}

/// The rays of a small image of a closed mesh with many silhouettes.
class StarRays : public testing::Test {
protected:
    StarRays() : scene_(star(4, 3)), bvh_(build_bvh(scene_.topology(), scene_.positions())) {
        ViewSpec view;
        view.width = view.height = 64;
        view.ao_count = 2;
        view.light = {1.5, 2.5, 1};
        primary_ = camera_rays_of(scene_, view);
        hits_ = trace_all(reference_tracer(bvh_, primary_), primary_).hits;
    }

    /// Of any kind but primary and single rays.
    RaySet secondary(RayKind kind, std::uint32_t samples = 2) const {
        return make_secondary_rays(primary_, hits_, {&scene_.topology(), scene_.positions()}, kind,
                                   samples);
    }

    void expect_that_paper_tracer_agrees(const RaySet& set, std::size_t least_hits) const {
        const PeerTree tree = build_peer_tree(scene_.topology(), scene_.positions());
        const TraceAnswers answers = trace_all(paper_tracer(tree, set), set);
        const Tracer single = our_tracers(bvh_, best_simd_target(), set).back();
        EXPECT_GE(count_hits(set, answers), least_hits);
        // Rays within rounding of an edge may choose its other side.
        EXPECT_LE(count_mismatches(set, trace_all(single, set), answers), 4u);
    }

    TestScene scene_;
    Bvh bvh_;
    RaySet primary_;
    AlignedVector<Hit> hits_;
};

TEST_F(StarRays, TracersOfAllKindsAgree) {
    for (const RayKind kind :
         {RayKind::kPrimary, RayKind::kShadow, RayKind::kDiffuse, RayKind::kAo}) {
        const RaySet set = kind == RayKind::kPrimary ? primary_ : secondary(kind);
        const TraceAnswers expected = trace_all(reference_tracer(bvh_, set), set);
        for (const Tracer& tracer : our_tracers(bvh_, best_simd_target(), set)) {
            for (const TileRange& range : set.ranges(4)) tracer.trace(range);
            EXPECT_EQ(count_mismatches(set, expected, tracer.answers()), 0u) << tracer.name;
        }
    }
}

TEST_F(StarRays, DiffuseRaysLeaveEachSurfaceInDirectionsOfTheirOwnWithoutAnEnd) {
    const RaySet diffuse = secondary(RayKind::kDiffuse);
    const RaySet ao = secondary(RayKind::kAo, 1);
    EXPECT_EQ(diffuse.active_count, static_cast<std::size_t>(std::ranges::count_if(
                                        hits_, [](const Hit& h) { return h.prim_id != kNoPrim; })));
    ASSERT_EQ(diffuse.rays.size(), ao.rays.size());
    std::set<std::tuple<float, float, float>> directions;
    for (std::size_t i = 0; i < ao.rays.size(); ++i) {
        if (diffuse.active[i] == 0) continue;
        const vec3 dir = diffuse.rays[i].dir;
        directions.insert({dir.x, dir.y, dir.z});
        EXPECT_EQ(diffuse.rays[i].org, ao.rays[i].org);
        EXPECT_EQ(diffuse.rays[i].tfar, kInfiniteT);
    }
    // Two of them may be equal by chance.
    EXPECT_GT(directions.size(), diffuse.active_count - diffuse.active_count / 100);
}

TEST_F(StarRays, PaperTracerFindsClosestHitsAndOccludedRays) {
    expect_that_paper_tracer_agrees(primary_, 100);
    expect_that_paper_tracer_agrees(secondary(RayKind::kShadow), 100);
}

TEST_F(StarRays, PaperTracerSeesAllSidesFromInside) {
    ViewSpec view;
    view.width = view.height = 64;
    view.fov = 140;
    view.eye = {0, 0, 0};
    view.target = {0.1, 0.2, -1};
    const RaySet set = camera_rays_of(scene_, view);
    expect_that_paper_tracer_agrees(set, set.active_count);
}

TEST(BuildPeerTree, HasEveryFiniteTriangleOnce) {
    for (const NamedScene& named : adversarial_scenes()) {
        const Topology& topology = named.scene.topology();
        const std::vector<vec3>& positions = named.scene.positions();
        std::vector<std::uint32_t> expected;
        for (std::uint32_t id = 0; id < topology.triangles.size(); ++id) {
            const uvec3 t = topology.triangles[id];
            if (is_finite_vertex(positions[t.x]) && is_finite_vertex(positions[t.y]) &&
                is_finite_vertex(positions[t.z]))
                expected.push_back(id);
        }
        std::vector<std::uint32_t> found;
        for (const PeerTriangle& t : build_peer_tree(topology, positions).triangles)
            found.push_back(t.prim_id);
        std::ranges::sort(found);
        EXPECT_EQ(found, expected) << named.name;
    }
}

float distance_from(const BenchScene& scene, vec3 p) {
    float d2 = INFINITY;
    for (const uvec3& t : scene.topology().triangles) {
        d2 = std::min(d2, triangle_distance2(p, scene.positions[t.x], scene.positions[t.y],
                                             scene.positions[t.z]));
    }
    return std::sqrt(d2);
}

TEST(QueryPoints, AreTheSameOnEachCallAndWhereTheyAreSaidToBe) {
    const BenchScene scene = open_bench_scene("builtin:spikes:500", 64);
    const std::vector<vec3> in_box = points_in_box(scene, 300);
    const std::vector<vec3> near = points_near_surface(scene, 300);
    EXPECT_EQ(in_box, points_in_box(scene, 300));
    EXPECT_EQ(near, points_near_surface(scene, 300));
    Box box;
    for (const vec3& p : scene.positions) box.extend(p);
    const vec3 sides = box.upper - box.lower;
    const float longest = std::max({sides.x, sides.y, sides.z});
    int far_in_box = 0;
    for (const vec3& p : in_box) {
        for (int axis = 0; axis < 3; ++axis)
            EXPECT_TRUE(p[axis] >= box.lower[axis] && p[axis] <= box.upper[axis]);
        far_in_box += distance_from(scene, p) > 0.02f * longest;
    }
    EXPECT_GT(far_in_box, 100);
    for (const vec3& p : near) EXPECT_LE(distance_from(scene, p), 0.0174f * longest);
}

TEST(QueryPoints, AreFiniteWhereVerticesAreNot) {
    const BenchScene scene = open_bench_scene("builtin:soup", 64);
    for (const vec3& p : points_near_surface(scene, 1000))
        EXPECT_TRUE(std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z));
    for (const Ray& ray : random_rays(scene, 1000)) {
        EXPECT_TRUE(std::isfinite(ray.org.x) && std::isfinite(ray.org.y));
        EXPECT_GT(glm::dot(ray.dir, ray.dir), 0);
    }
}

TEST(ClosestPoint, IsAtTheDistanceOfTheRule) {
    Random random(1);
    for (int i = 0; i < 10000; ++i) {
        const vec3 p = random.point();
        const vec3 a = random.point();
        const vec3 b = random.point();
        const vec3 c = random.point();
        const float ours = std::sqrt(triangle_distance2(p, a, b, c));
        EXPECT_NEAR(ours, glm::distance(p, ericson_closest_point(p, a, b, c)), 1e-5f);
    }
}

}  // namespace
}  // namespace mray::test
