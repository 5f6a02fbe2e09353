// Surroundings that should not matter, and a machine without Vulkan.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/app/program.h"
#include "tests/app/scenes.h"

namespace mray::test {
namespace {

std::string image_hash(const std::string& scene, const Surroundings& surroundings) {
    TemporaryFolder folder;
    return json_of(run({"render", scene, "--backend", "cpu", "--size", "16x16", "--frames", "0",
                        "--fov", "40.5", "--json", "-", "--out", folder.file("out")},
                       surroundings))["frames"][0]["image_hash"];
}

TEST(Environment, LocaleHomeTerminalAndTimeZoneDoNotMatter) {
    TemporaryFolder folder;
    const std::string scene = folder.write("t.obj", unit_triangle(1.5));
    const std::string expected = image_hash(scene, {});
    for (const Words& environment :
         {Words{"LC_ALL=de_DE.UTF-8", "LANG=de_DE.UTF-8"}, Words{"LC_ALL=tr_TR.UTF-8"},
          Words{"HOME", "XDG_CACHE_HOME=/proc", "XDG_CONFIG_HOME=/proc"},
          Words{"TERM=dumb", "TZ=Nowhere/Never"}, Words{"PATH", "TMPDIR=/none"}}) {
        EXPECT_EQ(image_hash(scene, {.environment = environment}), expected) << environment[0];
    }
}

TEST(Environment, PathsNeedNotBeUtf8) {
    TemporaryFolder folder;
    const std::string scene = folder.write("gr\xfc\xdf \xff.obj", unit_triangle());
    EXPECT_EQ(json_of(run({"info", scene, "--json", "-"}))["triangles"], 1);
    EXPECT_EQ(run({"render", scene, "--backend", "cpu", "--size", "8x8", "--out",
                   folder.file("\xe4\xff")})
                  .code,
              0);
}

// Without a driver, or without Vulkan in the build, each command fails with 4, and commands that
// may choose a backend use the CPU.
const Surroundings kNoDriver = {
    .environment = {"VK_ICD_FILENAMES=/none.json", "VK_DRIVER_FILES=/none.json"}};

TEST(Environment, MissingVulkanIsUnavailable) {
    TemporaryFolder folder;
    const std::vector<Words> commands = {
        {"render", "builtin:cloth:500", "--backend", "vulkan", "--out", folder.file("out")},
        {"render", "builtin:cloth:500", "--device", "0", "--out", folder.file("out")},
        {"crosscheck", "builtin:cloth:500"},
        {"crosscheck", "builtin:cloth:500", "--backend", "vulkan"},
        {"probe", "builtin:cloth:500", "--frame", "0", "--pixel", "0,0", "--backend", "vulkan"},
        {"profile", "builtin:cloth:500", "--backend", "vulkan"},
        {"devices"}};
    for (const auto& command : commands) {
        const Outcome outcome = run(command, kNoDriver);
        EXPECT_EQ(outcome.code, 4) << command[0] << ": " << outcome.err;
        EXPECT_EQ(lines(outcome.err).size(), 1u) << outcome.err;
        EXPECT_TRUE(outcome.err.starts_with("morphray: Vulkan: ")) << outcome.err;
        EXPECT_TRUE(folder.names().empty()) << command[0];
    }
}

TEST(Environment, DevicesWritesItsReportWithoutVulkanToo) {
    for (const Words& command :
         {Words{"devices", "--json", "-"}, Words{"devices", "--check", "--json", "-"}}) {
        const Outcome outcome = run(command, kNoDriver);
        EXPECT_EQ(outcome.code, 4) << outcome.err;
        const auto json = nlohmann::json::parse(outcome.out);
        EXPECT_TRUE(json["devices"].empty());
        EXPECT_TRUE(json["error"].get<std::string>().starts_with("Vulkan: "));
    }
}

TEST(Environment, ABadSceneIsBadInputOnAMachineWithoutVulkanToo) {
    TemporaryFolder folder;
    const std::string bad = folder.write("bad.obj", "v 0 0 0\nf 1 2 3\n");
    for (const Words& command :
         std::vector<Words>{{"render", bad, "--backend", "vulkan"},
                            {"crosscheck", bad},
                            {"crosscheck", bad, "--backend", "vulkan"},
                            {"probe", bad, "--frame", "0", "--pixel", "0,0", "--backend", "vulkan"},
                            {"profile", bad, "--backend", "vulkan"}}) {
        const Outcome outcome =
            run(command, {.environment = kNoDriver.environment, .folder = folder.path()});
        EXPECT_EQ(outcome.code, 3) << command[0] << ": " << outcome.err;
        EXPECT_TRUE(outcome.err.starts_with(bad + ":2:")) << outcome.err;
    }
}

TEST(Environment, AutomaticBackendFallsBackWithOneWarning) {
    TemporaryFolder folder;
    const Outcome outcome = run({"render", "builtin:cloth:500", "--size", "16x16", "--frames",
                                 "0..2", "--json", "-", "--out", folder.file("out")},
                                kNoDriver);
    EXPECT_EQ(json_of(outcome)["backend"], "cpu");
    EXPECT_EQ(lines(outcome.err).size(), 1u) << outcome.err;
    EXPECT_TRUE(outcome.err.starts_with("morphray: warning: ")) << outcome.err;
}

}  // namespace
}  // namespace mray::test
