// probe, profile, info and policies of updates: known results, and reports that can be parsed.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <regex>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "tests/app/program.h"
#include "tests/app/scenes.h"

namespace mray::test {

// As in tests/scenes/gltf/gltf_builder.h.
using Json = nlohmann::json;

namespace {

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
        EXPECT_TRUE(has(hit, "secondary rays        0 occluded in the image\n"));
        EXPECT_TRUE(has(hit, "  15   org "));
        EXPECT_TRUE(std::regex_search(hit, std::regex("fails\n +0  wins( +[-0-9a-fx.p+]+){4} *\n")))
            << hit;
        const std::string miss = probe(backend, "0,0");
        EXPECT_TRUE(miss.starts_with("nothing; all agree\n")) << miss;
        EXPECT_TRUE(miss.ends_with("no triangle comes near\n")) << miss;
    }
}

TEST(Frames, TreeIsNotBuiltOutsideTheAnimation) {
    const TemporaryFolder folder;
    for (const std::string command :
         {"render", "profile", "profile --policies refit", "probe --frame 0 --pixel 0,0"}) {
        for (const std::string frame : {"25", "-5"}) {
            const Outcome outcome = run(
                words(command + " builtin:cloth:500 --backend cpu --size 8x8 --build-at " + frame),
                {.folder = folder.path()});
            EXPECT_EQ(outcome.code, 2) << outcome.err;
            EXPECT_EQ(outcome.err, "morphray: --build-at: frame " + frame +
                                       " is not in the scene, which has 0 to 24\n");
        }
    }
    EXPECT_TRUE(folder.names().empty());
}

TEST(Profile, MeasuresEveryFrame) {
    const Json json = json_of(run({"profile", "builtin:cloth:500", "--backend", "cpu", "--size",
                                   "16x16", "--repeat", "2", "--json", "-"}));
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
    const Words line = {"profile", "builtin:cloth:500", "--backend", "cpu",      "--size",
                        "16x16",   "--repeat",          "1",         "--frames", "0..1"};
    const Outcome text = run(line);
    ASSERT_EQ(text.code, 0) << text.err;
    EXPECT_TRUE(text.out.starts_with("refit ")) << text.out;
    EXPECT_TRUE(lines(text.out).back().starts_with("all    cpu ")) << text.out;
    for (const std::string& row : lines(text.out)) EXPECT_LE(row.size(), 80u) << row;
    Words with_csv = line;
    with_csv.insert(with_csv.end(), {"--csv", "-"});
    const auto rows = lines(run(with_csv).out);
    ASSERT_EQ(rows.size(), 3u);
    EXPECT_TRUE(rows[0].starts_with("frame,backend,deform [ms],")) << rows[0];
    EXPECT_TRUE(rows[0].ends_with(",runs,machine,device,version")) << rows[0];
    for (const std::string& row : {rows[1], rows[2]}) EXPECT_TRUE(has(row, ",1,\"")) << row;
}

TEST(Info, CountsTrianglesAndVertices) {
    TemporaryFolder folder;
    const std::string scene =
        folder.write("s.obj", square_at(2) + "v 9 9 9\nf 1 2 2\nf 5 5 5\nf 1 2 5\n");
    const Json json = json_of(run({"info", scene, "--bvh", "--json", "-"}));
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

TEST(Policies, RenderReportsEachUpdateAndItsReason) {
    const TemporaryFolder folder;
    const Outcome outcome =
        run(words("render builtin:orbits:800 --backend cpu --size 48x48 --frames 0..12:2 "
                  "--update every:3 -v --json - --out " +
                  folder.file("out")));
    ASSERT_EQ(outcome.code, 0) << outcome.err;
    const Json report = Json::parse(outcome.out);
    Words updates;
    for (const Json& frame : report["frames"]) {
        updates.push_back(frame["update"]);
        EXPECT_FALSE(frame["reason"].get<std::string>().empty());
    }
    EXPECT_EQ(updates, (Words{"build", "refit", "refit", "rebuild", "refit", "refit", "rebuild"}));
    EXPECT_TRUE(has(outcome.err, "frame 6: rebuild, asked for"));
}

Words compare(const Words& more) {
    return words(
        "profile builtin:orbits:600 --policies refit,rebuild,every:2 --backend cpu "
        "--size 48x48 --frames 0..20:4",
        more);
}

TEST(ProfilePolicies, JsonHasEachPolicyWithItsFigures) {
    const Json report = json_of(run(compare({"--json", "-"})));
    EXPECT_EQ(report["command"], "profile");
    for (const char* const key : {"machine", "version", "devices"})
        EXPECT_TRUE(report["environment"].contains(key)) << key;
    ASSERT_EQ(report["policies"].size(), 3u);
    for (const Json& policy : report["policies"]) {
        std::set<std::string> keys;
        for (const auto& [key, value] : policy.items()) keys.insert(key);
        EXPECT_EQ(keys, (std::set<std::string>{"policy", "backend", "total_ms", "median_frame_ms",
                                               "worst_frame_ms", "regret", "rebuilds", "total",
                                               "hits_hashes"}));
        EXPECT_GT(policy["total"]["least_ms"], 0);
        EXPECT_LE(policy["total"]["least_ms"], policy["total_ms"]);
        EXPECT_GE(policy["total"]["most_ms"], policy["total_ms"]);
        EXPECT_GE(policy["regret"], 0);
        EXPECT_GE(policy["worst_frame_ms"], policy["median_frame_ms"]);
        EXPECT_EQ(policy["hits_hashes"].size(), 6u);
        EXPECT_EQ(policy["hits_hashes"], report["policies"][0]["hits_hashes"]);
    }
    EXPECT_EQ(report["policies"][0]["rebuilds"], 0);
    EXPECT_EQ(report["policies"][1]["rebuilds"], 5);
    // The least total is that of one of the policies.
    std::set<double> regrets;
    for (const Json& policy : report["policies"]) regrets.insert(policy["regret"].get<double>());
    EXPECT_EQ(*regrets.begin(), 0);
}

TEST(ProfilePolicies, TextHasTheFiguresOfAllRoundsAndCsvEveryFrame) {
    const TemporaryFolder folder;
    const Outcome outcome = run(compare({"--csv", folder.file("frames.csv")}));
    ASSERT_EQ(outcome.code, 0) << outcome.err;
    const Words text = lines(outcome.out);
    ASSERT_GE(text.size(), 9u) << outcome.out;
    EXPECT_TRUE(has(text[0], " on cpu: ")) << text[0];
    EXPECT_TRUE(has(outcome.out, "; morphray 0.")) << outcome.out;
    EXPECT_TRUE(has(outcome.out, "times in ms of 5 rounds; ")) << outcome.out;
    const char* const rows[] = {"refit  ", "rebuild  ", "every:2  "};
    for (std::size_t i = 0; i < std::size(rows); ++i)
        EXPECT_TRUE(text[text.size() - 3 + i].starts_with(rows[i])) << outcome.out;
    // The headline has numbers of the table.
    const std::string headline = outcome.out.substr(0, outcome.out.find("\n\n"));
    int found = 0;
    for (std::size_t i = text.size() - 3; i < text.size(); ++i) {
        std::istringstream row(text[i]);
        std::string policy, backend, total;
        row >> policy >> backend >> total;
        found += has(headline, policy + " " + total + " ms");
    }
    EXPECT_EQ(found, 2) << outcome.out;
    for (const std::string& line : text) EXPECT_LE(line.size(), 80u) << line;
    EXPECT_EQ(lines(read_file(folder.file("frames.csv"))).size(), 1u + 18u);
}

TEST(ProfilePolicies, ThatDoTheSameAreOneRow) {
    const Json policies = json_of(run(words(
        "profile builtin:orbits:600 --policies refit,rebuild,every:100 --backend cpu --size 16x16 "
        "--frames 0..4 --repeat 1 --json -")))["policies"];
    ASSERT_EQ(policies.size(), 2u);
    EXPECT_EQ(policies[0]["policy"], "refit, every:100");
    EXPECT_EQ(policies[1]["policy"], "rebuild");
}

TEST(ProfilePolicies, NameNoQuickestOfFewRounds) {
    const Outcome outcome = run(compare({"--repeat", "2"}));
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    EXPECT_TRUE(outcome.out.starts_with("too few rounds to name the quickest on cpu: "))
        << outcome.out;
}

}  // namespace
}  // namespace mray::test
