// morphray chart: rays, methods, scores and figures of little effort, and refused arguments.
#include <gtest/gtest.h>
#include <signal.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <map>
#include <set>
#include <sstream>
#include <thread>

#include "common/base/errors.h"
#include "cpu/image/tile_tracer.h"
#include "lab/accuracy/charts.h"
#include "scenes/procedural/procedural.h"
#include "tests/app/program.h"
#include "tests/support/test_scene.h"

namespace mray::test {
namespace {

using namespace lab;

constexpr Effort kLittle{.chunk_rays = 4096, .chunks = 2, .slow_chunks = 1, .failure_rays = 4096};
constexpr std::array kKinds = {RayKind::kPrimary, RayKind::kAimed, RayKind::kShadow,
                               RayKind::kDiffuse};

ChartInput cloth() {
    const auto animation = make_procedural("cloth", 500);
    std::vector<vec3> positions(animation->topology().vertex_count);
    animation->positions(12, positions);
    return {"cloth", animation->topology(), std::move(positions)};
}

/// One more triangle, which no scene space can show beside the others.
ChartInput with_far_vertex(ChartInput input) {
    input.name = "far vertex";
    input.positions.emplace_back(1e30f, 0.0f, 0.0f);
    input.topology.triangles.push_back({0, 1, input.topology.vertex_count++});
    input.topology.albedo.push_back(kDefaultAlbedo);
    return input;
}

const ChartContext kContext{
    .effort = kLittle, .devices = {}, .details = "machine; command", .done = [] {}};

/// The rows of a table by the names of its columns.
std::vector<std::map<std::string, std::string>> rows_of(const Table& table) {
    std::istringstream text(table.csv());
    const auto cells = [](const std::string& line) {
        std::vector<std::string> all;
        std::istringstream in(line + ",");
        for (std::string cell; std::getline(in, cell, ',');) all.push_back(cell);
        return all;
    };
    std::string line;
    std::getline(text, line);
    const std::vector<std::string> names = cells(line);
    std::vector<std::map<std::string, std::string>> rows;
    while (std::getline(text, line)) {
        const std::vector<std::string> values = cells(line);
        EXPECT_EQ(values.size(), names.size()) << line;
        for (std::size_t i = 0; i < names.size(); ++i) {
            if (i == 0) rows.emplace_back();
            rows.back()[names[i]] = values[i];
        }
    }
    return rows;
}

TEST(ChartRays, AreTheSameInBothSpaces) {
    ChartInput input = cloth();
    for (vec3& p : input.positions) p += vec3(4000, 4000, 4000);
    const ChartScene scene = make_chart_scene(input);
    const ExactReferee ours(scene.topology, scene.scene_space.positions, scene.scene_space.tree);
    const ExactReferee theirs(scene.topology, scene.world_space.positions, scene.world_space.tree);
    for (const RayKind kind : kKinds) {
        const RaySet rays = make_chart_rays(scene, kind, 1, 4096);
        const RaySet world = to_world(rays, scene.space);
        ASSERT_EQ(rays.rays.size(), world.rays.size());
        for (std::size_t i = 0; i < rays.rays.size(); ++i) {
            ASSERT_EQ(ours.closest(rays.rays[i]).prim_id, theirs.closest(world.rays[i]).prim_id)
                << name_of(kind) << ' ' << i;
        }
    }
}

TEST(ChartRays, AimAtTheMeshBesideAFarVertex) {
    const ChartScene scene = make_chart_scene(with_far_vertex(cloth()));
    EXPECT_EQ(scene.targets.size(), scene.topology.triangles.size() - 1);
    for (const RayKind kind : kKinds) {
        const RaySet rays = make_chart_rays(scene, kind, 0, 4096);
        const TraceAnswers answers = trace_all(reference_tracer(scene.bvh, rays), rays);
        std::size_t hits = 0;
        for (const Hit& hit : answers.hits) hits += hit.prim_id != kNoPrim;
        for (const std::uint8_t occluded : answers.occluded) hits += occluded;
        EXPECT_GT(hits + rays.active_count * rays.any_hit(), 400u) << name_of(kind);
    }
}

TEST(ChartRays, OfTilesFitPacketsAndMeetVerticesAndEdges) {
    const ChartScene scene = make_chart_scene(cloth());
    const RaySet rays = make_chart_rays(scene, RayKind::kAimed, 0, 16 * 4096);
    const cpu::TileTracer tracer(scene.bvh, best_simd_target());
    std::vector<Hit> hits(4096);
    const ExactReferee referee(scene.topology, scene.scene_space.positions, scene.scene_space.tree);
    std::size_t in_packets = 0;
    std::size_t hits_in_all = 0;
    std::size_t near_edges = 0;
    for (const TileRays& tile : rays.tiles) {
        in_packets += tracer.intersect_stored(
            {&rays.stored[tile.begin], 64, 64, 64, rays.rays[tile.begin].org}, hits.data());
        for (std::size_t i = tile.begin; i < tile.end; ++i) {
            const Truth truth = referee.closest(rays.rays[i]);
            if (!truth.hit()) continue;
            ++hits_in_all;
            const uvec3 t = scene.topology.triangles[truth.prim_id];
            const std::vector<vec3>& p = scene.scene_space.positions;
            near_edges +=
                ExactTriangle(rays.rays[i], p[t.x], p[t.y], p[t.z]).edge_distance() < 1e-4;
        }
    }
    if (best_simd_target().name != std::string("scalar")) {
        EXPECT_GE(in_packets, 12u);
    }
    // From near most rays go through the middle of a triangle.
    EXPECT_GT(near_edges, hits_in_all / 10);
    EXPECT_GT(hits_in_all, rays.rays.size() / 8);
}

TEST(Chart, FindsNoWrongAnswerOfTheProgramsTracers) {
    std::vector<ChartInput> inputs = failure_scenes();
    inputs.push_back(cloth());
    inputs.push_back(with_far_vertex(cloth()));
    for (const ChartInput& input : inputs) {
        const ChartScene scene = make_chart_scene(input);
        const MakeTracers methods = chart_methods(scene, {});
        const auto ours = [&](const ChartRays& rays) {
            std::vector<Tracer> tracers = methods(rays);
            std::erase_if(tracers, [](const Tracer& one) { return one.group != "ours"; });
            EXPECT_GE(tracers.size(), 4u);
            return tracers;
        };
        for (const RayKind kind : kKinds) {
            for (const ChartPoint& point : measure(scene, ours, kind, kLittle, [] {})) {
                EXPECT_EQ(point.score.wrong(), 0u)
                    << input.name << ' ' << name_of(kind) << ' ' << point.method;
            }
        }
    }
}

TEST(Chart, SeesAPlantedMethodInItsOwnPointAlone) {
    const ChartScene scene = make_chart_scene(cloth());
    const MakeTracers methods = chart_methods(scene, {});
    const auto with_planted = [&](const ChartRays& rays) {
        std::vector<Tracer> tracers = methods(rays);
        Tracer planted = reference_tracer(scene.bvh, rays.scene_space);
        planted.name = "planted";
        planted.group = "ours";
        planted.slow = true;
        planted.answers = [right = planted.answers] {
            TraceAnswers answers = right();
            for (std::size_t i = 0; i < answers.hits.size(); i += 64) answers.hits[i] = no_hit();
            for (std::size_t i = 0; i < answers.occluded.size(); i += 64) answers.occluded[i] ^= 1;
            for (std::size_t i = 1; i < answers.hits.size(); i += 64)
                answers.hits[i].t = std::nextafter(answers.hits[i].t, 1e30f) * 1.01f;
            return answers;
        };
        tracers.insert(tracers.begin() + 2, std::move(planted));
        return tracers;
    };
    for (const RayKind kind : kKinds) {
        int planted = 0;
        int ours = 0;
        for (const ChartPoint& point : measure(scene, with_planted, kind, kLittle, [] {})) {
            const double worst = point.score.errors[0].largest();
            if (point.method == "planted") {
                ++planted;
                EXPECT_GT(point.score.wrong(), 5u) << name_of(kind);
                // Occlusion has no t.
                EXPECT_EQ(worst > 50'000, kind != RayKind::kShadow) << name_of(kind);
            } else if (point.family == "ours") {
                ++ours;
                EXPECT_EQ(point.score.wrong(), 0u) << name_of(kind) << ' ' << point.method;
                EXPECT_LT(worst, 5'000) << name_of(kind) << ' ' << point.method;
            }
        }
        EXPECT_EQ(planted, 1) << name_of(kind);
        EXPECT_GE(ours, 4) << name_of(kind);
    }
}

TEST(Chart, HasARowForEachMethodAndWaysToTraceOnly) {
    std::map<std::string, std::set<std::string>> methods;
    for (const auto& row : rows_of(accuracy_chart(kContext, cloth(), "").table))
        methods[row.at("kind")].insert(row.at("method"));
    for (const char* const method : {"brute force", "scalar", "packets", "streams", "single",
                                     "2007 packets", "rule Woop", "rule double"})
        EXPECT_TRUE(methods["primary"].contains(method)) << method;
    EXPECT_EQ(methods["primary"], methods["aimed"]);
    EXPECT_TRUE(methods["shadow"].contains("light packets"));
    for (const char* const method : {"packets", "2007 packets"})
        EXPECT_FALSE(methods["diffuse"].contains(method)) << method;
}

/// A method whose chunks had these speeds.
ChartPoint point(const char* method, const char* family, std::vector<double> mrays, int wrong = 0) {
    ChartPoint made{method, family, {}};
    made.score.rays = 1'000'000;
    made.score.verdicts[static_cast<std::size_t>(Verdict::kLeak)] = wrong;
    made.score.mrays = std::move(mrays);
    return made;
}

TEST(Chart, NamesAFastestMethodOnlyWhereNoOtherMayBeFaster) {
    const ChartPoint slow = point("slow", "2007", {44, 44, 43});
    const ChartPoint fast = point("fast", "ours", {60, 61, 62, 63});
    const ChartPoint near = point("near", "ours", {57, 58, 61, 62});
    // Chunks beside another program.
    const ChartPoint torn = point("torn", "ours", {4, 6, 67, 159, 160});
    const ChartPoint torn_below = point("torn", "ours", {4, 6, 40, 159, 160});
    EXPECT_EQ(ranking(std::vector{fast, slow}),
              "the fastest is fast (61.5 Mray/s, 0 of 1 million wrong)");
    EXPECT_EQ(ranking(std::vector{fast, near, slow}),
              "not told apart: fast (61.5 Mray/s, 0 of 1 million wrong), near (59.5 Mray/s, 0 of 1 "
              "million wrong)");
    EXPECT_TRUE(ranking(std::vector{torn, slow}).starts_with("not ranked, as disturbed: torn"));
    EXPECT_TRUE(ranking(std::vector{slow, torn_below}).starts_with("not told apart: slow"));
    EXPECT_EQ(accuracy_title({slow, near, fast}),
              "Camera rays: morphray 1.4 times as fast as slow, none of 1 million wrong");
    EXPECT_EQ(accuracy_title({near, point("peer", "rules", {90, 91}, 3)}),
              "Camera rays: peer 1.5 times as fast as morphray, 3 of 1 million wrong");
    EXPECT_EQ(accuracy_title({slow, torn}),
              "Camera rays: morphray and slow are not told apart (disturbed)");
    EXPECT_EQ(accuracy_title({slow, torn_below}),
              "Camera rays: slow and morphray are not told apart");
}

TEST(Chart, NamesSomeMethodsInItsFirstFigureAndNoneThatIsBeaten) {
    const Chart chart = accuracy_chart(kContext, cloth(), "");
    std::map<std::string, std::set<std::string>> names;
    std::map<std::string, double> fastest;
    for (const auto& row : rows_of(chart.table)) {
        if (!row.at("shown as").empty()) names[row.at("kind")].insert(row.at("shown as"));
        double& speed = fastest[row.at("kind")];
        speed = std::max(speed, std::stod(row.at("speed [Mray/s]")));
    }
    for (const auto& row : rows_of(chart.table)) {
        if (std::stod(row.at("speed [Mray/s]")) == fastest[row.at("kind")]) {
            EXPECT_NE(row.at("shown as"), "") << row.at("method");
        }
    }
    for (const RayKind kind : kKinds) {
        const std::set<std::string>& some = names[name_of(kind)];
        for (const char* name : {"morphray single", "rule Woop", "rule double"})
            EXPECT_TRUE(some.contains(name)) << name_of(kind) << ' ' << name;
        EXPECT_FALSE(some.contains("morphray brute force"));
        EXPECT_LE(some.size(), 10u);
    }
}

/// The cloth and two of its frames.
ChartInput moving_cloth() {
    ChartInput input = cloth();
    const auto animation = make_procedural("cloth", 500);
    for (const double frame : {0.0, 20.0}) {
        input.frame_numbers.push_back(frame);
        input.frames.emplace_back(animation->topology().vertex_count);
        animation->positions(frame, input.frames.back());
    }
    return input;
}

TEST(Deformation, HasEachWayToUpdateInEachFrameAndOursAreRight) {
    const Chart chart = deformation_chart(kContext, moving_cloth(), "_2");
    EXPECT_EQ(chart.name, "deformation_2");
    std::map<std::string, std::vector<std::string>> hits;
    for (const auto& row : rows_of(chart.table)) {
        hits[row.at("method")].push_back(row.at("kind") + row.at("frame") + " " +
                                         row.at("t largest [ulp]"));
        if (row.at("family") == "ours") {
            EXPECT_EQ(row.at("wrong"), "0") << row.at("method");
        }
        EXPECT_GE(std::stod(row.at("frame [ms]")), std::stod(row.at("update [ms]")));
    }
    ASSERT_EQ(hits.size(), 6u);
    // All ways to update trace the same pose.
    for (const char* const method : {"restructure", "rebuild", "auto"})
        EXPECT_EQ(hits[method], hits["refit"]) << method;
    EXPECT_EQ(hits["2007 refit"], hits["2007 rebuild"]);
    EXPECT_EQ(hits["refit"].size(), 4u);
}

TEST(Chart, IsDrawnFromItsTable) {
    for (const Chart& chart :
         {accuracy_chart(kContext, cloth(), ""), failure_chart(kContext, {cloth()}),
          deformation_chart(kContext, moving_cloth(), "")}) {
        const std::string csv = chart.table.csv();
        for (const auto& [name, figure, notes] : chart.figures) {
            EXPECT_LE(figure.title.size(), 90u) << figure.title;
            const std::string svg = plot::draw(figure, csv, "svg");
            EXPECT_NE(svg.find("<svg"), std::string::npos) << name;
            EXPECT_NE(svg.find(">machine; command<"), std::string::npos) << name;
            const std::string pdf = plot::draw(figure, csv, "pdf", true);
            EXPECT_EQ(pdf.substr(0, 5), "%PDF-") << name;
            // 8.5 cm.
            EXPECT_NE(pdf.find("/MediaBox [ 0 0 240.9"), std::string::npos) << name;
            for (const plot::Panel& panel : figure.panels) {
                for (const char* key : {"x", "y", "series", "xlower", "lower", "shade", "label"}) {
                    EXPECT_TRUE(!panel.contains(key) ||
                                csv.find(panel.at(key)) != std::string::npos)
                        << panel.at(key);
                }
            }
        }
    }
}

/// The probability of at most k of n, summed term by term.
double binomial_sum(int k, int n, double p) {
    double sum = 0;
    for (int i = 0; i <= k; ++i)
        sum += std::exp(std::lgamma(n + 1) - std::lgamma(i + 1) - std::lgamma(n - i + 1) +
                        i * std::log(p) + (n - i) * std::log1p(-p));
    return sum;
}

TEST(Rate, HasTheExactIntervalOfABinomial) {
    for (const int n : {1, 10, 1000, 100'000}) {
        for (const int k : {0, 1, 3, n / 3, n}) {
            if (k > n) continue;
            const Rate rate = rate_of(k, n);
            EXPECT_DOUBLE_EQ(rate.value, static_cast<double>(k) / n);
            if (k < n) {
                EXPECT_NEAR(binomial_sum(k, n, rate.upper), 0.025, 1e-8) << k << ' ' << n;
            }
            if (k > 0) {
                EXPECT_NEAR(binomial_sum(k - 1, n, rate.lower), 0.975, 1e-8) << k << ' ' << n;
            }
        }
        EXPECT_EQ(rate_of(0, n).lower, 0);
        EXPECT_EQ(rate_of(n, n).upper, 1);
    }
    EXPECT_NEAR(rate_of(0, 10'000'000).upper, 3.689e-7, 1e-10);
    EXPECT_EQ(rate_of(0, 0).upper, 1);
}

TEST(ErrorCounts, GiveQuantilesAndTheLargest) {
    ErrorCounts counts;
    EXPECT_EQ(counts.quantile(0.5), 0);
    for (int i = 1; i <= 1000; ++i) counts.add(i);
    ErrorCounts zeros;
    for (int i = 0; i < 1000; ++i) zeros.add(0);
    EXPECT_EQ(zeros.quantile(0.99), 0);
    EXPECT_NEAR(counts.quantile(0.5), 500, 12);
    EXPECT_NEAR(counts.quantile(0.99), 990, 22);
    EXPECT_EQ(counts.quantile(1), 1000);
    counts += zeros;
    EXPECT_EQ(counts.count(), 2000u);
    EXPECT_EQ(counts.quantile(0.5), 0);
    EXPECT_EQ(counts.largest(), 1000);
}

TEST(ChartCommand, RefusesAMissingSceneAndLeavesNothing) {
    const TemporaryFolder folder;
    const Outcome outcome =
        run({"chart", "builtin:cloth:500", "none.obj", "--quick", "--out", folder.file("charts")});
    EXPECT_EQ(outcome.code, 3) << outcome.err;
    EXPECT_TRUE(folder.names().empty());
}

TEST(ChartCommand, ReportsThatMatplotlibIsMissing) {
    const TemporaryFolder folder;
    const Outcome outcome =
        run({"chart", "builtin:cloth:500", "--quick", "--out", folder.file("charts")},
            {.environment = {"PATH=" + folder.path().string()}});
    EXPECT_EQ(outcome.code, 4) << outcome.err;
    EXPECT_NE(outcome.err.find("python3-matplotlib"), std::string::npos) << outcome.err;
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
