// The questions of --queries, and what counts as another answer.
#include <gtest/gtest.h>

#include <cmath>

#include "app/commands/crosscheck/query_check.h"
#include "common/bvh/builder/bvh_builder.h"
#include "cpu/cpu_backend.h"
#include "tests/app/crosscheck/planted_checks.h"

namespace mray::test {
namespace {

struct Asked {
    Topology topology;
    std::vector<vec3> positions;
    app::Questions questions;
    app::Answers answers;
};

/// A tetrahedron, and its answers.
Asked ask_tetrahedron(std::uint32_t count) {
    Asked asked;
    asked.topology.triangles = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};
    asked.topology.vertex_count = 4;
    asked.positions = {{0, 0, 0}, {1024, 0, 0}, {0, 1024, 0}, {0, 0, 1024}};
    asked.questions = app::pseudo_random_questions(asked.topology, asked.positions, count);
    const auto backend = cpu::make_cpu_backend({});
    backend->set_scene(asked.topology, asked.positions, build_bvh(asked.topology, asked.positions));
    asked.answers = app::answers_of(*backend, asked.questions);
    return asked;
}

TEST(QueryCheck, QuestionsAreTheSameAndHitTheMesh) {
    const Asked a = ask_tetrahedron(200);
    const Asked b = ask_tetrahedron(200);
    ASSERT_EQ(a.questions.rays.size(), 200u);
    ASSERT_EQ(a.questions.points.size(), 200u);
    EXPECT_EQ(app::compare_answers(a.answers, b.answers).total(), 0u);
    EXPECT_GT(a.answers.hits[1].hits.size(), 100u);
    std::size_t inside = 0;
    for (const FloatWinding& winding : a.answers.windings) inside += winding.winding != 0;
    EXPECT_GT(inside, 0u);
    EXPECT_LT(inside, 200u);
    for (const ClosestTriangle& closest : a.answers.closest) EXPECT_NE(closest.prim_id, kNoPrim);
}

TEST(QueryCheck, EmptyMeshHasQuestionsToo) {
    const app::Questions questions = app::pseudo_random_questions({}, {}, 5);
    EXPECT_EQ(questions.rays.size(), 5u);
    EXPECT_EQ(questions.points.size(), 5u);
}

TEST(QueryCheck, EveryBitOfAnAnswerCounts) {
    const Asked asked = ask_tetrahedron(50);
    {
        app::Answers other = asked.answers;
        float& t = other.hits[0].hits.front().t;
        t = std::nextafter(t, 0.0f);
        EXPECT_EQ(app::compare_answers(asked.answers, other).all_hits, 1u);
        EXPECT_EQ(app::compare_answers(asked.answers, other).total(), 1u);
    }
    {
        app::Answers other = asked.answers;
        ++other.hits[1].total.back();
        EXPECT_EQ(app::compare_answers(asked.answers, other).all_hits, 1u);
    }
    {
        app::Answers other = asked.answers;
        ++other.windings[3].crossings;
        other.uncertain.push_back({7, 0xFFFFFF});
        EXPECT_EQ(app::compare_answers(asked.answers, other).winding, 2u);
    }
    {
        app::Answers other = asked.answers;
        other.closest[4].d2 = std::nextafter(other.closest[4].d2, 1e30f);
        ++other.closest[5].prim_id;
        EXPECT_EQ(app::compare_answers(asked.answers, other).closest, 2u);
    }
}

TEST(QueryCheck, ReportsNameTheAnswersThatDiffer) {
    app::CheckRun run = planted_run(1, 1, 8, "scene.obj");
    ASSERT_TRUE(run.equal());
    app::CheckReport& report = run.scenes[0];
    report.queries = {{0, "cpu, rebuild", "brute", 100},
                      {0, "vulkan, rebuild", "brute", 100, {3, 1, 0}}};
    EXPECT_FALSE(run.equal());
    EXPECT_EQ(report.differing(), 1u);
    const std::string line =
        "frame 0, vulkan, rebuild, against brute: 3 rays differ in all hits, 1 point differs in "
        "the winding";
    EXPECT_NE(
        app::table_text(report).find("100 rays and points a frame, 2: 1 of 2 differ\n  " + line),
        std::string::npos)
        << app::table_text(report);
    EXPECT_NE(app::to_json(run).find("\"all_hits\": 3"), std::string::npos);
    EXPECT_NE(app::to_junit(run).find("<failure message=\"3 rays differ"), std::string::npos);
}

}  // namespace
}  // namespace mray::test
