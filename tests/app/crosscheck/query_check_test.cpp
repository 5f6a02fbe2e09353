// The batch of --queries, and what counts as another answer.
#include <gtest/gtest.h>

#include <cmath>

#include "app/commands/cross_checker.h"
#include "common/bvh/builder/bvh_builder.h"
#include "cpu/cpu_backend.h"
#include "tests/app/crosscheck/planted_checks.h"

namespace mray::test {
namespace {

struct Answered {
    Topology topology;
    std::vector<vec3> positions;
    app::CheckBatch batch;
    app::Answers answers;
};

/// A tetrahedron, and its answers.
Answered query_tetrahedron(std::uint32_t count) {
    Answered one;
    one.topology.triangles = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};
    one.topology.vertex_count = 4;
    one.positions = {{0, 0, 0}, {1024, 0, 0}, {0, 1024, 0}, {0, 0, 1024}};
    one.batch = app::pseudo_random_batch(one.topology, one.positions, count);
    const auto backend = cpu::make_cpu_backend({});
    backend->set_scene(one.topology, one.positions, build_bvh(one.topology, one.positions));
    one.answers = app::answers_of(*backend, one.batch);
    return one;
}

TEST(QueryCheck, BatchesAreTheSameAndHitTheMesh) {
    const Answered a = query_tetrahedron(200);
    const Answered b = query_tetrahedron(200);
    ASSERT_EQ(a.batch.rays.size(), 200u);
    ASSERT_EQ(a.batch.points.size(), 200u);
    EXPECT_EQ(app::compare_answers(a.answers, b.answers).total(), 0u);
    EXPECT_GT(a.answers.hits[1].hits.size(), 100u);
    std::size_t inside = 0;
    for (const FloatWinding& winding : a.answers.windings) inside += winding.winding != 0;
    EXPECT_GT(inside, 0u);
    EXPECT_LT(inside, 200u);
    for (const ClosestTriangle& closest : a.answers.closest) EXPECT_NE(closest.prim_id, kNoPrim);
}

TEST(QueryCheck, EmptyMeshHasABatchToo) {
    const app::CheckBatch batch = app::pseudo_random_batch({}, {}, 5);
    EXPECT_EQ(batch.rays.size(), 5u);
    EXPECT_EQ(batch.points.size(), 5u);
}

TEST(QueryCheck, EveryBitOfAnAnswerCounts) {
    const Answered one = query_tetrahedron(50);
    {
        app::Answers other = one.answers;
        float& t = other.hits[0].hits.front().t;
        t = std::nextafter(t, 0.0f);
        EXPECT_EQ(app::compare_answers(one.answers, other).all_hits, 1u);
        EXPECT_EQ(app::compare_answers(one.answers, other).total(), 1u);
    }
    {
        app::Answers other = one.answers;
        ++other.hits[1].total.back();
        EXPECT_EQ(app::compare_answers(one.answers, other).all_hits, 1u);
    }
    {
        app::Answers other = one.answers;
        ++other.windings[3].crossings;
        other.uncertain.push_back({7, 0xFFFFFF});
        EXPECT_EQ(app::compare_answers(one.answers, other).winding, 2u);
    }
    {
        app::Answers other = one.answers;
        other.closest[4].d2 = std::nextafter(other.closest[4].d2, 1e30f);
        ++other.closest[5].prim_id;
        EXPECT_EQ(app::compare_answers(one.answers, other).closest, 2u);
    }
}

TEST(QueryCheck, ReportsNameTheAnswersThatDiffer) {
    app::Json run = planted_run(1, 1, 8, "scene.obj");
    app::Json& scene = run["scenes"][0];
    EXPECT_EQ(scene["equal"], true);
    app::CrosscheckOptions options = options_of("scene.obj", 8);
    options.query_count = 100;
    app::CheckedImage image{{"cpu"}, 0, morphray::Rays::primary, "brute"};
    app::add_answers(scene, options, image, {});
    image.variant.backend = "vulkan";
    app::add_answers(scene, options, image, {3, 1, 0});
    EXPECT_EQ(scene["equal"], false);
    EXPECT_EQ(app::count_differing(scene["queries"]), 1u);
    const std::string text = app::run_text(run);
    EXPECT_NE(text.find("frame 0, vulkan, rebuild, queries: other answers: 3 in all hits, 1 in "
                        "windings, 0 in closest triangles\n"),
              std::string::npos)
        << text;
    EXPECT_EQ(scene["queries"][1]["differences"]["all_hits"], 3);
    EXPECT_NE(app::to_junit(run).find("<failure message=\"other answers: 3 in"), std::string::npos);
}

}  // namespace
}  // namespace mray::test
