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

using Variants = std::set<std::string>;

/// The scene in the report of a cross-check that finds these variants equal in three frames.
Json crosscheck(const std::string& more, const Variants& expected) {
    const Json scene = json_of(run(
        words("crosscheck builtin:cloth:400 --size 24x24 --frames 0..24:12 --json - --validate " +
              more)))["scenes"][0];
    Variants variants;
    for (const Json& row : scene["rows"]) variants.insert(row["variant"]);
    EXPECT_EQ(variants, expected);
    EXPECT_EQ(scene["trees"].size(), 3u);
    return scene;
}

TEST(WithVulkan, CrosscheckFindsAllVariantsEqual) {
    const Json scene =
        crosscheck("--simd off --queries 60",
                   {"cpu, refit on cpu", "cpu, refit on vulkan", "cpu, rebuild",
                    "vulkan, refit on cpu", "vulkan, refit on vulkan", "vulkan, rebuild"});
    EXPECT_EQ(scene["rows"].size(), 6u * 3 * 3);
    EXPECT_EQ(scene["queries"].size(), 6u * 3);
    for (const Json& tree : scene["trees"])
        EXPECT_EQ(tree["cpu_bvh_hash"], tree["vulkan_bvh_hash"]);
}

TEST(WithVulkan, CrosscheckOfVulkanComparesVulkanOnly) {
    for (const std::string reference : {"brute", "cpu"}) {
        const Json scene =
            crosscheck("--backend vulkan --rays primary --reference " + reference,
                       {"vulkan, refit on cpu", "vulkan, refit on vulkan", "vulkan, rebuild"});
        EXPECT_EQ(scene["rows"].size(), 3u * 3);
        for (const Json& row : scene["rows"]) EXPECT_EQ(row["reference"], reference);
    }
}

TEST(WithVulkan, ADeviceThatFailedItsTestIsRefusedUntilItPassesOne) {
    TemporaryFolder folder;
    const Surroundings surroundings = {.environment = {"XDG_CACHE_HOME=" + folder.file("cache")}};
    const Words render = {"render", "builtin:cloth:400", "--size",    "8x8",   "--frames", "0",
                          "--out",  folder.file("out"),  "--backend", "vulkan"};
    ASSERT_EQ(run(render, surroundings).code, 0);
    // The first use has kept a result, which is now made a failure.
    std::vector<std::filesystem::path> kept;
    for (const auto& entry : std::filesystem::directory_iterator(folder.file("cache/morphray")))
        kept.push_back(entry.path());
    ASSERT_EQ(kept.size(), 1u);
    std::ifstream file(kept[0]);
    std::string text{std::istreambuf_iterator<char>(file), {}};
    ASSERT_TRUE(has(text, "passed"));
    text.replace(text.find("passed"), std::string::npos, "lost\nit did not answer\n");
    std::ofstream(kept[0]) << text;
    const Outcome refused = run(render, surroundings);
    EXPECT_EQ(refused.code, 7);
    EXPECT_TRUE(has(refused.err, "it did not answer"));
    const Outcome checked = run({"devices", "--check", "--json", "-"}, surroundings);
    EXPECT_EQ(checked.code, 0) << checked.err;
    EXPECT_EQ(Json::parse(checked.out)["devices"][0]["check"]["passed"], true);
    EXPECT_EQ(run(render, surroundings).code, 0);
}

TEST(WithVulkan, AutomaticBackendIsTheCpuWithoutAGpu) {
    const Json devices = Json::parse(run({"devices", "--json", "-"}).out)["devices"];
    ASSERT_FALSE(devices.empty());
    EXPECT_EQ(devices[0]["index"], 0);
    EXPECT_EQ(devices[0]["uuid"].get<std::string>().size(), 32u);
    bool has_gpu = false;
    for (const Json& device : devices)
        has_gpu = has_gpu || (device["type"] != "cpu" && device["unusable"] == "");
    TemporaryFolder folder;
    const Words render = {
        "render", "builtin:cloth:400", "--size", "8x8", "--frames", "0", "--json", "-",
        "--out",  folder.file("out")};
    const Outcome outcome = run(render);
    ASSERT_EQ(outcome.code, 0) << outcome.err;
    EXPECT_EQ(outcome.err, "");
    EXPECT_EQ(Json::parse(outcome.out)["backend"], has_gpu ? "vulkan" : "cpu");
    // Naming a device requires Vulkan.
    Words named = render;
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
