// morphray chart: refused arguments, and charts of little effort.
#include <gtest/gtest.h>
#include <signal.h>

#include <chrono>
#include <sstream>
#include <thread>

#include "common/base/errors.h"
#include "lab/accuracy/charts.h"
#include "scenes/procedural/procedural.h"
#include "tests/app/program.h"

namespace mray::test {
namespace {

constexpr lab::Effort kLittle{.side = 64, .aimed_rays = 600, .rounds = 1, .failure_rays = 300};

lab::ChartInput cloth() {
    const auto animation = make_procedural("cloth", 500);
    std::vector<vec3> positions(animation->topology().vertex_count);
    animation->positions(12, positions);
    return {"cloth", animation->topology(), std::move(positions)};
}

std::size_t rows_of(const Table& table) {
    std::istringstream text(table.csv());
    std::size_t count = 0;
    for (std::string line; std::getline(text, line);) ++count;
    return count - 1;
}

std::unique_ptr<Backend> no_vulkan() { throw Error(ErrorKind::kUnavailable, "not in this test"); }

const lab::ChartContext kContext{
    .effort = kLittle, .make_vulkan_backend = no_vulkan, .footer = "machine; command"};

TEST(Chart, HasARowForEachMethodAndScene) {
    EXPECT_GT(rows_of(lab::accuracy_chart(kContext, cloth(), "").table), 5u);
    // Embree adds methods if it is installed.
    const std::size_t scenes = lab::failure_scenes().size() + 1;
    EXPECT_GE(rows_of(lab::failure_chart(kContext, {cloth()}).table), 3 * scenes);
}

TEST(Chart, FindsNoWrongAnswerOfTheProgramsTracers) {
    std::vector<lab::ChartInput> inputs = lab::failure_scenes();
    inputs.push_back(cloth());
    for (const lab::ChartInput& input : inputs) {
        // From far away one ulp of t is larger than the detail's triangles
        // (docs/guide/crosscheck.md).
        if (input.name == "detail 1 in 1e6") continue;
        const lab::ChartScene scene = lab::make_chart_scene(input, 64, 10000);
        for (const lab::Measured& measured :
             lab::measure(scene, lab::our_methods(scene, no_vulkan), 1)) {
            EXPECT_EQ(measured.camera.wrong(), 0u) << input.name << ' ' << measured.method;
            EXPECT_EQ(measured.aimed.wrong(), 0u) << input.name << ' ' << measured.method;
        }
    }
}

TEST(Chart, TracesTheSameRaysInBothSpaces) {
    lab::ChartInput input = cloth();
    for (vec3& p : input.positions) p += vec3(4000, 4000, 4000);
    const lab::ChartScene scene = lab::make_chart_scene(input, 64, 500);
    const std::vector<Ray>& rays = scene.scene_space.aimed.rays;
    ASSERT_EQ(rays.size(), scene.world_space.aimed.rays.size());
    const lab::ExactReferee ours(scene.topology, scene.scene_space.positions,
                                 scene.scene_space.bvh);
    const lab::ExactReferee theirs(scene.topology, scene.world_space.positions,
                                   scene.world_space.bvh);
    for (std::size_t i = 0; i < rays.size(); ++i) {
        EXPECT_EQ(ours.closest(rays[i]).prim_id,
                  theirs.closest(scene.world_space.aimed.rays[i]).prim_id);
    }
}

TEST(Chart, IsDrawnFromItsTable) {
    for (const lab::Chart& chart :
         {lab::accuracy_chart(kContext, cloth(), ""), lab::failure_chart(kContext, {cloth()})}) {
        const std::string svg = plot::draw(chart.figure, chart.table.csv(), "svg");
        EXPECT_NE(svg.find("<svg"), std::string::npos) << chart.name;
        EXPECT_NE(svg.find(">machine; command<"), std::string::npos) << chart.name;
        for (const plot::Panel& panel : chart.figure.panels) {
            for (const char* name : {"x", "y", "series"})
                EXPECT_NE(chart.table.csv().find(panel.at(name)), std::string::npos) << name;
        }
    }
}

TEST(ChartCommand, RefusesAMissingSceneAndLeavesNothing) {
    const TemporaryFolder folder;
    const Outcome outcome =
        run({"chart", "builtin:cloth:500", "none.obj", "--quick", "--out", folder.file("charts")});
    EXPECT_EQ(outcome.code, 3) << outcome.err;
    EXPECT_TRUE(folder.names().empty());
}

TEST(ChartCommand, ReportsThatGnuplotIsMissing) {
    const TemporaryFolder folder;
    const Outcome outcome =
        run({"chart", "builtin:cloth:500", "--quick", "--out", folder.file("charts")},
            {.environment = {"PATH=" + folder.path().string()}});
    EXPECT_EQ(outcome.code, 4) << outcome.err;
    EXPECT_NE(outcome.err.find("gnuplot-nox"), std::string::npos) << outcome.err;
}

// morphray has become another program by then.
TEST(ChartCommand, InterruptKeepsNoChart) {
    const TemporaryFolder folder;
    Started chart({"chart", "builtin:cloth:4000", "--out", folder.file("charts")});
    std::this_thread::sleep_for(std::chrono::seconds(1));
    chart.send(SIGINT);
    EXPECT_EQ(chart.wait().code, 130);
    EXPECT_TRUE(folder.names().empty());
}

}  // namespace
}  // namespace mray::test
