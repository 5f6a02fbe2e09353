// render --update and profile --policies: same images, reports that can be parsed.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <set>

#include "tests/app/program.h"
#include "tests/app/scenes.h"

namespace mray::test {
namespace {

using Json = nlohmann::json;

std::vector<std::string> render(const TemporaryFolder& folder,
                                const std::vector<std::string>& more) {
    std::vector<std::string> arguments = {
        "render", "builtin:orbits:800", "--size", "48x48", "--frames", "0..12:2",
        "--out",  folder.file("out"),   "--json", "-"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return arguments;
}

std::vector<std::string> hashes_of(const Json& frames) {
    std::vector<std::string> hashes;
    for (const Json& frame : frames) hashes.push_back(frame["hits_hash"]);
    return hashes;
}

TEST(Policies, EveryUpdateGivesTheSameImages) {
    const TemporaryFolder folder;
    std::set<std::vector<std::string>> hashes;
    for (const char* update : {"refit", "rebuild", "every:2", "auto"}) {
        const Outcome outcome = run(render(folder, {"--backend", "cpu", "--update", update}));
        ASSERT_EQ(outcome.code, 0) << outcome.err;
        hashes.insert(hashes_of(Json::parse(outcome.out)["frames"]));
    }
    EXPECT_EQ(hashes.size(), 1u);
}

TEST(Policies, SequenceThatChangesItsFacesIsRefusedUnderEveryUpdate) {
    const TemporaryFolder folder;
    for (const int frame : {0, 1, 2})
        folder.write(fmt::format("f_{}.obj", frame), square_of_frame(frame, 2));
    for (const char* update : {"refit", "rebuild", "auto"}) {
        const Outcome outcome =
            run({"render", folder.file("f_%d.obj"), "--size", "16x16", "--backend", "cpu",
                 "--update", update, "--frames", "0..2", "--out", folder.file("out")});
        EXPECT_EQ(outcome.code, 8) << update;
        EXPECT_NE(outcome.err.find("frame 2 has other faces"), std::string::npos) << outcome.err;
        EXPECT_TRUE(std::filesystem::exists(folder.path() / "out/frame_0001.png"));
        EXPECT_FALSE(std::filesystem::exists(folder.path() / "out/frame_0002.png"));
    }
}

TEST(Policies, RenderReportsEachUpdateAndItsReason) {
    const TemporaryFolder folder;
    const Outcome outcome = run(render(folder, {"--backend", "cpu", "--update", "every:3", "-v"}));
    ASSERT_EQ(outcome.code, 0) << outcome.err;
    const Json report = Json::parse(outcome.out);
    std::vector<std::string> updates;
    for (const Json& frame : report["frames"]) {
        updates.push_back(frame["update"]);
        EXPECT_FALSE(frame["reason"].get<std::string>().empty());
    }
    EXPECT_EQ(updates, (std::vector<std::string>{"build", "refit", "refit", "rebuild", "refit",
                                                 "refit", "rebuild"}));
    EXPECT_NE(outcome.err.find("frame 6: rebuild, asked for"), std::string::npos) << outcome.err;
}

TEST(Policies, UnknownOnesAreRefused) {
    const TemporaryFolder folder;
    for (const char* value : {"every:0", "atuo"}) {
        const Outcome outcome = run(render(folder, {"--update", value}));
        EXPECT_EQ(outcome.code, 2) << value;
        EXPECT_NE(outcome.err.find("--update"), std::string::npos) << outcome.err;
    }
    for (const char* list : {"refit,", ",", "refit auto"}) {
        EXPECT_EQ(run({"profile", "builtin:cloth:500", "--policies", list}).code, 2) << list;
    }
}

std::vector<std::string> compare(const std::vector<std::string>& more) {
    std::vector<std::string> arguments = {"profile",    "builtin:orbits:600",
                                          "--policies", "refit,rebuild,auto",
                                          "--backend",  "cpu",
                                          "--size",     "48x48",
                                          "--frames",   "0..20:4",
                                          "--repeat",   "2"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return arguments;
}

TEST(ProfilePolicies, JsonHasEachPolicyWithItsFigures) {
    const Outcome outcome = run(compare({"--json", "-"}));
    ASSERT_EQ(outcome.code, 0) << outcome.err;
    const Json report = Json::parse(outcome.out);
    EXPECT_EQ(report["command"], "profile");
    ASSERT_EQ(report["policies"].size(), 3u);
    for (const Json& policy : report["policies"]) {
        std::set<std::string> keys;
        for (const auto& [key, value] : policy.items()) keys.insert(key);
        EXPECT_EQ(keys, (std::set<std::string>{"policy", "backend", "total_ms", "median_frame_ms",
                                               "worst_frame_ms", "regret", "rebuilds", "total",
                                               "hits_hashes"}));
        EXPECT_GT(policy["total"]["least_ms"], 0);
        EXPECT_LE(policy["total"]["least_ms"], policy["total"]["median_ms"]);
        EXPECT_GE(policy["total"]["spread_percent"], 0);
        EXPECT_GT(policy["total_ms"], 0);
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

TEST(ProfilePolicies, TextHasTheFiguresOfAllRounds) {
    const Outcome outcome = run(compare({}));
    ASSERT_EQ(outcome.code, 0) << outcome.err;
    const std::vector<std::string> text = lines(outcome.out);
    ASSERT_EQ(text.size(), 8u) << outcome.out;
    EXPECT_TRUE(text[0].starts_with("quickest: ")) << text[0];
    EXPECT_TRUE(text[2].starts_with("times in ms of 2 rounds; ")) << text[2];
    const char* const rows[] = {"refit  ", "rebuild  ", "auto  "};
    for (std::size_t i = 0; i < std::size(rows); ++i)
        EXPECT_TRUE(text[5 + i].starts_with(rows[i])) << text[5 + i];
    for (const std::string& line : text) EXPECT_LE(line.size(), 80u) << line;
}

TEST(ProfilePolicies, CsvHoldsEveryFrame) {
    const TemporaryFolder folder;
    const Outcome outcome = run(compare({"--csv", folder.file("frames.csv")}));
    ASSERT_EQ(outcome.code, 0) << outcome.err;
    EXPECT_EQ(lines(read_file(folder.file("frames.csv"))).size(), 1u + 18u);
}

TEST(ProfilePolicies, PlotNeedsAnEndingAndPolicies) {
    EXPECT_EQ(run(compare({"--plot", "chart.jpg"})).code, 2);
    EXPECT_EQ(run({"profile", "builtin:cloth:500", "--plot", "chart.svg"}).code, 2);
}

TEST(ProfilePolicies, WithoutGnuplotPlotIsUnavailableBeforeAnythingIsMeasured) {
    const TemporaryFolder folder;
    const Outcome outcome =
        run(compare({"--plot", folder.file("chart.svg")}), {.environment = {"PATH=/nowhere"}});
    EXPECT_EQ(outcome.code, 4);
    EXPECT_NE(outcome.err.find("gnuplot"), std::string::npos) << outcome.err;
    EXPECT_TRUE(folder.names().empty());
}

TEST(ProfilePolicies, PlotIsAnImage) {
    const TemporaryFolder folder;
    for (const char* name : {"chart.svg", "chart.png"}) {
        const Outcome outcome = run(compare({"--plot", folder.file(name)}));
        ASSERT_EQ(outcome.code, 0) << outcome.err;
        const std::string image = read_file(folder.file(name));
        EXPECT_GT(image.size(), 2000u);
        EXPECT_NE(image.substr(0, 300).find(name[6] == 's' ? "<svg" : "PNG"), std::string::npos);
    }
}

}  // namespace
}  // namespace mray::test
