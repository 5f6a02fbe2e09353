// profile and info: results that are known beforehand, and reports that can be parsed.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <regex>
#include <string>
#include <vector>

#include "tests/app/program.h"
#include "tests/app/scenes.h"

namespace mray::test {
namespace {

using Json = nlohmann::json;

TEST(Probe, FrameOutsideTheAnimationIsRefused) {
    EXPECT_EQ(run({"probe", "builtin:cloth:500", "--frame", "25", "--pixel", "0,0"}).code, 2);
    EXPECT_EQ(run({"probe", "builtin:cloth:500", "--frame", "nan", "--pixel", "0,0"}).code, 2);
}

TEST(Probe, GivesTheSameResultOnEveryBackend) {
    const TemporaryFolder folder;
    const std::string scene = folder.write("s.obj", square_at(0));
    const auto probe = [&](const char* backend, const char* pixel) {
        const Outcome outcome =
            run({"probe", scene, "--frame", "0", "--size", "32x32", "--eye", "0,0,5", "--target",
                 "0,0,0", "--pixel", pixel, "--backend", backend, "--rays", "ao"});
        EXPECT_EQ(outcome.code, 0) << outcome.err;
        return outcome.out;
    };
    for (const char* backend : {"cpu", "brute"}) {
        const std::string hit = probe(backend, "16,16");
        EXPECT_TRUE(hit.starts_with("triangle 0, 5 away; all agree\n")) << hit;
        EXPECT_NE(hit.find("secondary rays        0 occluded in the image\n"), std::string::npos);
        EXPECT_NE(hit.find("  15   org "), std::string::npos) << hit;
        EXPECT_TRUE(std::regex_search(hit, std::regex("fails\n +0  wins( +[-0-9a-fx.p+]+){4} *\n")))
            << hit;
        const std::string miss = probe(backend, "0,0");
        EXPECT_TRUE(miss.starts_with("nothing; all agree\n")) << miss;
        EXPECT_TRUE(miss.ends_with("no triangle comes near\n")) << miss;
    }
}

TEST(Frames, TreeIsNotBuiltOutsideTheAnimation) {
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

TEST(Profile, SaysWhatARefitIsWorthAndCsvHasARowAFrame) {
    const std::vector<std::string> line = {
        "profile", "builtin:cloth:500", "--backend", "cpu",      "--size",
        "16x16",   "--repeat",          "1",         "--frames", "0..1"};
    const Outcome text = run(line);
    ASSERT_EQ(text.code, 0) << text.err;
    EXPECT_TRUE(text.out.starts_with("refit ")) << text.out;
    EXPECT_TRUE(lines(text.out).back().starts_with("all    cpu ")) << text.out;
    for (const std::string& row : lines(text.out)) EXPECT_LE(row.size(), 80u) << row;
    std::vector<std::string> with_csv = line;
    with_csv.insert(with_csv.end(), {"--csv", "-"});
    const auto rows = lines(run(with_csv).out);
    ASSERT_EQ(rows.size(), 3u);
    EXPECT_TRUE(rows[0].starts_with("frame,backend,deform,")) << rows[0];
    for (const std::string& row : rows) EXPECT_EQ(std::ranges::count(row, ','), 8) << row;
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
    EXPECT_EQ(json["edges"]["open"], 5);
    EXPECT_EQ(json["edges"]["turned"], 1);
    EXPECT_EQ(json["first_frame"], 0);
    EXPECT_EQ(json["last_frame"], 0);
    EXPECT_EQ(json["bounds"]["lower"], (Json{1, -1, 0}));
    EXPECT_EQ(json["bounds"]["upper"], (Json{9, 9, 9}));
    EXPECT_EQ(json["tree"]["nodes"], 1);
}

}  // namespace
}  // namespace mray::test
