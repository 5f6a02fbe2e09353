// The help of every command, and the examples in it.
#include <gtest/gtest.h>

#include <filesystem>
#include <regex>
#include <sstream>

#include "tests/app/program.h"
#include "tests/clips/gltf/gltf_builder.h"

namespace mray::test {
namespace {

std::vector<std::string> commands() {
    std::vector<std::string> names;
    bool listed = false;
    for (const std::string& line : lines(run({"help"}).out)) {
        if (line == "Commands:")
            listed = true;
        else if (line.empty())
            listed = false;
        else if (listed && line[2] != ' ')
            names.push_back(line.substr(2, line.find(' ', 2) - 2));
    }
    return names;
}

std::string help_of(const std::string& command) { return run({"help", command}).out; }

std::vector<std::string> examples_of(const std::string& command) {
    std::vector<std::string> examples;
    bool listed = false;
    for (const std::string& line : lines(help_of(command))) {
        if (line == "Examples:")
            listed = true;
        else if (line.empty())
            listed = false;
        else if (listed && line.starts_with("    "))
            examples.push_back(line.substr(4));
    }
    return examples;
}

TEST(Help, FitsIntoEightyColumns) {
    EXPECT_GE(commands().size(), 9u);
    std::vector<std::string> texts = {run({"help"}).out};
    for (const std::string& command : commands()) texts.push_back(help_of(command));
    for (const std::string& text : texts) {
        for (const std::string& line : lines(text)) {
            EXPECT_LE(line.size(), 80u) << line;
            EXPECT_FALSE(line.ends_with(' ')) << line;
        }
    }
}

TEST(Help, EveryCommandHasUsageExamplesAndExitCodes) {
    for (const std::string& command : commands()) {
        const std::string help = help_of(command);
        EXPECT_NE(help.find("\nUsage: morphray " + command), std::string::npos) << help;
        EXPECT_NE(help.find("\nExit codes: 0 ok, 1 a check failed"), std::string::npos) << help;
        const std::vector<std::string> examples = examples_of(command);
        EXPECT_FALSE(examples.empty()) << command;
        for (const std::string& example : examples)
            EXPECT_NE(example.find("morphray " + command), std::string::npos) << example;
    }
}

TEST(Help, OneIdeaHasOneSpellingInAllCommands) {
    for (const std::string& command : commands()) {
        const std::string help = help_of(command);
        EXPECT_EQ(help.find("  --out "), std::string::npos) << command;
        EXPECT_EQ(help.find("  --quiet "), std::string::npos) << command;
        for (const char* one : {"  --frame ", "  --frames "})
            EXPECT_EQ(help.find(one), std::string::npos) << command;
    }
}

/// The example with a small scene and image, and with what this build has.
std::string small(std::string line) {
    line = std::regex_replace(line, std::regex("(builtin:[a-z]+)( |$)"), "$1:300$2");
    line = std::regex_replace(line, std::regex("--pixel [0-9,]+"), "--pixel 20,20 --size 40x40");
    // A window that ends by itself.
    line = std::regex_replace(line, std::regex(" --play"), " --play --exit-after 1");
    if (std::regex_search(line, std::regex("morphray (render|profile|crosscheck) ")))
        line += " --size 40x30";
#ifndef MORPHRAY_HAS_VULKAN
    if (line.find("--backend") == std::string::npos &&
        std::regex_search(line, std::regex("morphray (profile|crosscheck) ")))
        line += " --backend cpu";
#endif
    return line;
}

/// Runs `morphray ...` or `echo ... | morphray ...`.
Outcome run_line(const std::string& line, const std::filesystem::path& folder) {
    const std::string echo = "echo ";
    const std::size_t pipe = line.find(" | ");
    Surroundings surroundings{.folder = folder};
    if (pipe != std::string::npos)
        surroundings.input = line.substr(echo.size(), pipe - echo.size()) + '\n';
    std::istringstream words(pipe == std::string::npos ? line : line.substr(pipe + 3));
    std::vector<std::string> arguments;
    for (std::string word; words >> word;) arguments.push_back(word);
    EXPECT_EQ(arguments.front(), "morphray");
    arguments.erase(arguments.begin());
    return run(arguments, surroundings);
}

TEST(Help, ExamplesWork) {
    const TemporaryFolder folder;
    // The files that the examples of diff compare.
    for (const std::string name : {"here", "there"}) {
        const Outcome made =
            run_line("morphray render builtin:cloth:300 --frame 8 --size 40x30 -o " + name +
                         ".png --exr half --hits " + name + ".hits",
                     folder.path());
        ASSERT_EQ(made.code, 0) << made.err;
    }
    // The sequence that the examples of index name.
    for (const char* name : {"frames/f_1.obj", "frames/f_2.obj"})
        folder.write(name, "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    // The other half of what the examples of merge put together.
    const Outcome half = run_line(
        "morphray render builtin:cloth:300 --frames 0..24:6 --size 40x30 --shard 2/2 --out shards",
        folder.path());
    ASSERT_EQ(half.code, 0) << half.err;
    // The animation of the example of render.
    GltfBuilder robot = triangle_file();
    robot.add_animation(0, "translation", {0, 1},
                        robot.add_accessor<float>({0, 0, 0, 1, 0, 0}, "VEC3"));
    robot.json["animations"][0]["name"] = "walk";
    folder.write("robot.glb", robot.glb());
    // Charts take minutes: this one is refused as soon as its line is understood.
    folder.write("charts/file", "");
    for (const std::string& command : commands()) {
        for (const std::string& example : examples_of(command)) {
            const Outcome outcome = run_line(small(example), folder.path());
#ifndef MORPHRAY_HAS_VULKAN
            if (command == "devices") {
                EXPECT_EQ(outcome.code, 4) << outcome.err;
                continue;
            }
#endif
            if (command == "view") {
                // Without a display, or without a window built in.
                EXPECT_TRUE(outcome.code == 0 || outcome.code == 4) << outcome.err;
                continue;
            }
            if (command == "chart") {
                EXPECT_NE(outcome.code, 0);
                EXPECT_NE(outcome.code, 2) << outcome.err;
                EXPECT_EQ(lines(outcome.err).size(), 1u) << outcome.err;
                continue;
            }
            EXPECT_EQ(outcome.code, 0) << small(example) << '\n' << outcome.err;
        }
    }
}

}  // namespace
}  // namespace mray::test
