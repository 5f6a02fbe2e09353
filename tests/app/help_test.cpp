// The help of every command, and the examples in it.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <regex>
#include <sstream>

#include "tests/app/program.h"

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
        if (listed) examples.push_back(line.substr(2));
        listed = listed || line == "Examples:";
    }
    return examples;
}

/// The line with a small scene and image, and with what this build has. Names of files stay.
std::string small(std::string line) {
    line = std::regex_replace(line, std::regex("(builtin:[a-z]+)( |$)"), "$1:300$2");
    line = std::regex_replace(line, std::regex("--pixel [0-9,]+"), "--pixel 20,20 --size 40x40");
    // A window that ends by itself.
    line = std::regex_replace(line, std::regex(" --play"), " --play --screenshot played.png");
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

void expect_works(const std::string& command, const std::string& line,
                  const std::filesystem::path& folder) {
    const Outcome outcome = run_line(small(line), folder);
#ifndef MORPHRAY_HAS_VULKAN
    if (command == "devices") {
        EXPECT_EQ(outcome.code, 4) << outcome.err;
        return;
    }
#endif
    if (command == "view") {
        // Without a display, or without a window built in.
        EXPECT_TRUE(outcome.code == 0 || outcome.code == 4) << outcome.err;
        return;
    }
    if (command == "chart") {
        EXPECT_NE(outcome.code, 0);
        EXPECT_NE(outcome.code, 2) << outcome.err;
        EXPECT_EQ(lines(outcome.err).size(), 1u) << outcome.err;
        return;
    }
    EXPECT_EQ(outcome.code, 0) << small(line) << '\n' << outcome.err;
}

TEST(Help, HasAtMostTwelveOptionsIn80ColumnsAndTheRestOnRequest) {
    for (const std::string& command : commands()) {
        const auto options = [&](const std::string& flag) {
            const std::vector<std::string> text = lines(run({command, flag}).out);
            for (const std::string& line : text) EXPECT_LE(line.size(), 80u) << line;
            return std::ranges::count_if(
                text, [](const std::string& line) { return line.starts_with("  -"); });
        };
        EXPECT_LE(options("--help"), 12) << command;
        if (help_of(command).find("--help-all") != std::string::npos) {
            EXPECT_GT(options("--help-all"), options("--help")) << command;
        }
    }
}

TEST(Help, ExamplesWork) {
    EXPECT_EQ(commands().size(), 11u);
    for (const std::string& command : commands()) {
        // Nothing but the files that the project ships, and what the lines before have written.
        const TemporaryFolder folder;
        std::filesystem::create_directory_symlink(SHIPPED_FILES, folder.path() / "scenes");
        // Charts take minutes: this one is refused as soon as its line is understood.
        if (command == "chart") folder.write("charts/file", "");
        for (const std::string& line : examples_of(command))
            expect_works(command, line, folder.path());
    }
}

}  // namespace
}  // namespace mray::test
