// probe, profile and info: results that are known beforehand, and reports that can be parsed.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <vector>

#include "tests/app/program.h"
#include "tests/app/scenes.h"

namespace mray::test {
namespace {

using Json = nlohmann::json;

Json probe(const std::string& scene, std::vector<std::string> more) {
    std::vector<std::string> all = {"probe",  scene,   "--frame", "0",
                                    "--size", "32x32", "--json",  "-"};
    all.insert(all.end(), more.begin(), more.end());
    const Outcome outcome = run(all);
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    return Json::parse(outcome.out);
}

TEST(Probe, GivesTheSameResultOnEveryBackend) {
    TemporaryFolder folder;
    const std::string scene = folder.write("s.obj", square_at(0));
    for (const char* backend : {"cpu", "brute"}) {
        const Json json = probe(scene, {"--pixel", "16,16", "--backend", backend, "--eye", "0,0,5",
                                        "--target", "0,0,0", "--rays", "ao"});
        EXPECT_EQ(json["command"], "probe");
        EXPECT_EQ(json["hit"], json["hit_alone"]);
        const Json hit = json["hit"];
        const double t = hit["t"]["value"];
        EXPECT_NEAR(t * json["user_depth"].get<double>(), 5, 1e-5);
        EXPECT_EQ(json["secondary"].size(), 16u);
        EXPECT_EQ(json["occlusion"], 0);
        const Json first = json["candidates"].at(0);
        EXPECT_EQ(first["is_hit"], true);
        for (const char* name : {"prim_id", "t", "u", "v"}) EXPECT_EQ(first[name], hit[name]);
        for (const char* condition :
             {"may_hit", "inside", "has_area", "in_range", "finite", "meets_box"}) {
            EXPECT_EQ(first[condition], true) << condition;
        }
    }
}

TEST(Probe, MissHasNoHit) {
    TemporaryFolder folder;
    const std::string scene = folder.write("s.obj", square_at(0));
    const Json json =
        probe(scene, {"--pixel", "0,0", "--backend", "cpu", "--eye", "0,0,5", "--target", "0,0,0"});
    EXPECT_TRUE(json["hit"].is_null());
    EXPECT_TRUE(json["candidates"].empty());
}

TEST(Probe, FrameOutsideTheClipIsRefused) {
    EXPECT_EQ(run({"probe", "builtin:cloth:500", "--frame", "25", "--pixel", "0,0"}).code, 2);
    EXPECT_EQ(run({"probe", "builtin:cloth:500", "--frame", "nan", "--pixel", "0,0"}).code, 2);
}

TEST(Frames, TreeIsNotBuiltOutsideTheClip) {
    const TemporaryFolder folder;
    using Line = std::vector<std::string>;
    for (Line line : {Line{"render"}, Line{"profile"}, Line{"profile", "--policies", "refit"},
                      Line{"probe", "--frame", "0", "--pixel", "0,0"}}) {
        line.insert(line.begin() + 1, "builtin:cloth:500");
        line.insert(line.end(), {"--backend", "cpu", "--size", "8x8", "--build-at"});
        for (const char* const frame : {"25", "-5"}) {
            line.emplace_back(frame);
            const Outcome outcome = run(line, {.folder = folder.path()});
            EXPECT_EQ(outcome.code, 2) << outcome.err;
            EXPECT_EQ(outcome.err, fmt::format("morphray: --build-at: frame {} is not in the "
                                               "scene, which has 0 to 24\n",
                                               frame));
            line.pop_back();
        }
    }
    EXPECT_TRUE(folder.names().empty());
}

TEST(Profile, MeasuresEveryFrame) {
    const Outcome outcome = run({"profile", "builtin:cloth:500", "--backend", "cpu", "--size",
                                 "16x16", "--repeat", "2", "--json", "-"});
    ASSERT_EQ(outcome.code, 0) << outcome.err;
    const Json json = Json::parse(outcome.out);
    EXPECT_EQ(json["command"], "profile");
    EXPECT_EQ(json["repeat"], 2);
    EXPECT_GT(json["peak_memory_bytes"], 1 << 20);
    ASSERT_EQ(json["frames"].size(), 4u);
    EXPECT_EQ(json["frames"][0]["frame"], 0);
    EXPECT_EQ(json["frames"][3]["frame"], 24);
    for (const Json& frame : json["frames"]) {
        EXPECT_EQ(frame["backend"], "cpu");
        for (const char* number : {"deform_ms", "upload_ms", "refit_ms", "rebuild_ms", "trace_ms",
                                   "trace_rebuilt_ms", "rays", "sah_cost", "rebuilt_sah_cost"}) {
            EXPECT_TRUE(frame.at(number).is_number()) << number;
            EXPECT_GE(frame.at(number), 0) << number;
        }
    }
}

/// The cells of a row of CSV, none of which is quoted.
std::vector<std::string> cells_of(const std::string& row) {
    std::vector<std::string> cells(1);
    for (const char c : row) {
        if (c == ',') {
            cells.emplace_back();
        } else {
            cells.back() += c;
        }
    }
    return cells;
}

TEST(Profile, CsvHasARowAFrameAndUniqueColumns) {
    const Outcome outcome = run({"profile", "builtin:cloth:500", "--backend", "cpu", "--size",
                                 "16x16", "--repeat", "1", "--frames", "0..1", "--csv", "-"});
    ASSERT_EQ(outcome.code, 0) << outcome.err;
    const auto rows = lines(outcome.out);
    ASSERT_EQ(rows.size(), 3u);
    EXPECT_TRUE(rows[0].starts_with("frame,backend,deform ms,")) << rows[0];
    const std::vector<std::string> columns = cells_of(rows[0]);
    EXPECT_EQ(columns.size(), 26u);
    EXPECT_EQ(std::set<std::string>(columns.begin(), columns.end()).size(), columns.size());
    for (const std::string& row : rows) EXPECT_EQ(cells_of(row).size(), columns.size()) << row;
}

TEST(Info, CountsTrianglesAndVertices) {
    TemporaryFolder folder;
    const std::string scene =
        folder.write("s.obj", square_at(2) + "v 9 9 9\nf 1 2 2\nf 5 5 5\nf 1 2 5\n");
    const Outcome outcome = run({"info", scene, "--bvh", "--json", "-"});
    ASSERT_EQ(outcome.code, 0) << outcome.err;
    const Json json = Json::parse(outcome.out);
    EXPECT_EQ(json["triangles"], 5);
    EXPECT_EQ(json["vertices"], 5);
    EXPECT_EQ(json["zero_area"], 2);
    EXPECT_EQ(json["not_finite"], 0);
    EXPECT_EQ(json["first_frame"], 0);
    EXPECT_EQ(json["last_frame"], 0);
    EXPECT_EQ(json["bounds"]["lower"], (Json{1, -1, 0}));
    EXPECT_EQ(json["bounds"]["upper"], (Json{9, 9, 9}));
    ASSERT_EQ(json["trees"].size(), 2u);
    EXPECT_EQ(json["trees"][0]["build"], "binned");
    EXPECT_EQ(json["trees"][1]["build"], "sweep");
    EXPECT_EQ(json["trees"][0]["nodes"], 1);
}

}  // namespace
}  // namespace mray::test
