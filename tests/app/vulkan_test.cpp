// The program with both backends. Built when Vulkan is.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <set>

#include "tests/app/program.h"

namespace mray::test {
namespace {

using Json = nlohmann::json;

TEST(WithVulkan, CrosscheckFindsAllVariantsEqual) {
    TemporaryFolder folder;
    const Outcome outcome =
        run({"crosscheck", "builtin:cloth:400", "--size", "24x24", "--frames", "0..24:12", "--simd",
             "off", "--queries", "60", "--json", "-", "--validate"});
    ASSERT_EQ(outcome.code, 0) << outcome.out << outcome.err;
    const Json json = Json::parse(outcome.out);
    EXPECT_EQ(json["scenes"][0]["rows"].size(), 6u * 3 * 3);
    EXPECT_EQ(json["scenes"][0]["queries"].size(), 6u * 3);
    std::set<std::string> variants;
    for (const Json& row : json["scenes"][0]["rows"]) variants.insert(row["variant"]);
    EXPECT_EQ(variants, (std::set<std::string>{"cpu, refit on cpu", "cpu, refit on vulkan",
                                               "cpu, rebuild", "vulkan, refit on cpu",
                                               "vulkan, refit on vulkan", "vulkan, rebuild"}));
    ASSERT_EQ(json["scenes"][0]["trees"].size(), 3u);
    for (const Json& tree : json["scenes"][0]["trees"]) {
        EXPECT_EQ(tree["cpu_bvh_hash"], tree["vulkan_bvh_hash"]);
    }
    EXPECT_TRUE(folder.names().empty());
}

TEST(WithVulkan, CrosscheckOfVulkanComparesVulkanOnly) {
    for (const char* reference : {"brute", "cpu"}) {
        TemporaryFolder folder;
        const Outcome outcome = run({"crosscheck", "builtin:cloth:400", "--size", "24x24",
                                     "--frames", "0..24:12", "--backend", "vulkan", "--reference",
                                     reference, "--rays", "primary", "--json", "-", "--validate"});
        ASSERT_EQ(outcome.code, 0) << outcome.out << outcome.err;
        const Json json = Json::parse(outcome.out);
        EXPECT_EQ(json["scenes"][0]["rows"].size(), 3u * 3);
        EXPECT_EQ(json["scenes"][0]["trees"].size(), 3u);
        std::set<std::string> variants;
        for (const Json& row : json["scenes"][0]["rows"]) {
            variants.insert(row["variant"]);
            EXPECT_EQ(row["reference"], reference);
        }
        EXPECT_EQ(variants, (std::set<std::string>{"vulkan, refit on cpu",
                                                   "vulkan, refit on vulkan", "vulkan, rebuild"}));
    }
}

TEST(WithVulkan, TraceAnswersLikeTheCpu) {
    std::string rays;
    for (int i = 0; i < 200; ++i) {
        const std::string x = std::to_string(i / 100.0 - 1);
        rays += x + " 5 " + x + " 0.01 -1 0.02\n";
    }
    const auto answers = [&](const char* backend) {
        return run({"trace", "builtin:cloth:900", "--rays", "-", "--out", "-", "--backend",
                    backend},
                   {.input = rays})
            .out;
    };
    const std::string expected = answers("cpu");
    EXPECT_EQ(lines(expected).size(), 200u);
    EXPECT_EQ(answers("vulkan"), expected);
    EXPECT_EQ(answers("auto"), expected);
}

TEST(WithVulkan, DevicesAreListed) {
    const Outcome outcome = run({"devices", "--json", "-"});
    ASSERT_EQ(outcome.code, 0) << outcome.err;
    const Json json = Json::parse(outcome.out);
    ASSERT_FALSE(json["devices"].empty());
    EXPECT_EQ(json["devices"][0]["index"], 0);
    EXPECT_EQ(json["devices"][0]["uuid"].get<std::string>().size(), 32u);
}

TEST(WithVulkan, ADeviceThatFailedItsTestIsRefusedUntilItPassesOne) {
    TemporaryFolder folder;
    const Surroundings surroundings = {.environment = {"XDG_CACHE_HOME=" + folder.file("cache")}};
    const std::vector<std::string> render = {
        "render", "builtin:cloth:400", "--size",    "8x8",   "--frames", "0",
        "--out",  folder.file("out"),  "--backend", "vulkan"};
    ASSERT_EQ(run(render, surroundings).code, 0);
    // The first use has kept a result, which is now made a failure.
    std::vector<std::filesystem::path> kept;
    for (const auto& entry : std::filesystem::directory_iterator(folder.file("cache/morphray")))
        kept.push_back(entry.path());
    ASSERT_EQ(kept.size(), 1u);
    std::ifstream file(kept[0]);
    std::string text{std::istreambuf_iterator<char>(file), {}};
    ASSERT_NE(text.find("passed"), std::string::npos) << text;
    text.replace(text.find("passed"), std::string::npos, "lost\nit did not answer\n");
    std::ofstream(kept[0]) << text;
    const Outcome refused = run(render, surroundings);
    EXPECT_EQ(refused.code, 7);
    EXPECT_NE(refused.err.find("it did not answer"), std::string::npos) << refused.err;
    const Outcome checked = run({"devices", "--check", "--json", "-"}, surroundings);
    EXPECT_EQ(checked.code, 0) << checked.err;
    EXPECT_EQ(Json::parse(checked.out)["devices"][0]["check"]["passed"], true);
    EXPECT_EQ(run(render, surroundings).code, 0);
}

TEST(WithVulkan, AutomaticBackendIsTheCpuWithoutAGpu) {
    const Json devices = Json::parse(run({"devices", "--json", "-"}).out)["devices"];
    bool has_gpu = false;
    for (const Json& device : devices)
        has_gpu = has_gpu || (device["type"] != "cpu" && device["unusable"] == "");
    TemporaryFolder folder;
    const std::vector<std::string> render = {
        "render", "builtin:cloth:400", "--size", "8x8", "--frames", "0", "--json", "-",
        "--out",  folder.file("out")};
    const Outcome outcome = run(render);
    ASSERT_EQ(outcome.code, 0) << outcome.err;
    EXPECT_EQ(outcome.err, "");
    EXPECT_EQ(Json::parse(outcome.out)["backend"], has_gpu ? "vulkan" : "cpu");
    // Naming a device requires Vulkan.
    std::vector<std::string> named = render;
    named.insert(named.end(), {"--device", "0"});
    EXPECT_EQ(Json::parse(run(named).out)["backend"], "vulkan");
}

TEST(WithVulkan, UnknownDeviceIsUnavailable) {
    for (const char* device : {"99", "no such device"}) {
        TemporaryFolder folder;
        const Outcome refused =
            run({"render", "builtin:cloth:400", "--device", device, "--out", folder.file("out")});
        EXPECT_EQ(refused.code, 4) << refused.err;
        EXPECT_TRUE(folder.names().empty());
    }
}

}  // namespace
}  // namespace mray::test
