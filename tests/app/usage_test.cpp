// Messages about command lines that are refused, the help of every command, and its examples.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <iterator>
#include <regex>
#include <string>
#include <utility>
#include <vector>

#include "tests/app/program.h"

namespace mray::test {
namespace {

// Fails with this code and one line on stderr that holds the text; nothing on stdout.
void expect_refused(const Words& arguments, int code, const std::string& text) {
    const Outcome outcome = run(arguments);
    EXPECT_EQ(outcome.code, code) << outcome.err;
    EXPECT_EQ(outcome.out, "");
    EXPECT_EQ(lines(outcome.err).size(), 1u) << outcome.err;
    EXPECT_TRUE(has(outcome.err, text));
}

Words small_render(const Words& more) {
    // The folder cannot be made: a test that got as far as writing would fail with 5.
    return words("render builtin:cloth:500 --backend cpu --out /dev/null/out", more);
}

TEST(Usage, MissingArgumentsAndValuesAreNamed) {
    expect_refused({}, 2, "subcommand is required");
    expect_refused({"crosscheck"}, 2, "SCENES is required");
    expect_refused({"crosscheck", "--digest", "builtin:cloth"}, 2, "leave out SCENES");
    expect_refused({"crosscheck", "--digest", "--json", "-"}, 2, "leave out --json");
    expect_refused({"diff"}, 2, "FILES is required");
    expect_refused({"trace", "builtin:cloth:500"}, 2, "--rays is required");
    expect_refused({"query", "builtin:cloth", "--ask", "inside"}, 2, "--points");
    expect_refused(small_render({"--threads"}), 2, "--threads");
    expect_refused({"render", "builtin:cloth", "--out", ""}, 2, "--out: the value is empty");
}

TEST(Usage, MisspeltNamesComeWithThePlaceOfTheList) {
    expect_refused({"rendr", "builtin:cloth"}, 2,
                   "unknown argument 'rendr'; see `morphray --help`");
    expect_refused({"render", "builtin:clot"}, 2, "'clot'; `morphray info` lists them");
    expect_refused(small_render({"--szie=3x3"}), 2, "'--szie=3x3'; see `morphray render --help`");
    expect_refused(small_render({"--rays", "shadows"}), 2,
                   "--rays: 'shadows' is not one of primary|shadow|ao");
    // Commands that take any number of arguments name the option, too.
    expect_refused({"crosscheck", "builtin:cloth:500", "--framse", "0"}, 2, "--framse");
}

TEST(Usage, MoreThanOneOfASingleThingIsRefused) {
    expect_refused(small_render({"--threads", "2", "--threads", "2"}), 2, "--threads");
    expect_refused(small_render({"builtin:herd"}), 2, "put a pattern of files in quotes");
    expect_refused({"diff", "a.hits", "b.hits", "c.hits"}, 2, "FILES");
    expect_refused({"info", "builtin:cloth:500", "--frames", "0..4"}, 2, "0..4");
    expect_refused({"crosscheck", "builtin:cloth:500", "--json", "-", "--junit", "-"}, 2,
                   "stdout takes one report");
}

TEST(Usage, NumbersOutOfRangeAreRefused) {
    expect_refused({"crosscheck", "builtin:cloth:400", "--backend", "brute"}, 2, "brute");
    for (const char* value : {"0", "-1", "1025", "nan", "1e3", "", "99999999999999999999999"})
        expect_refused(small_render({"--threads", value}), 2, "--threads");
    for (const char* value : {"0x64", "-1x64", "64", "64x64x64", "nanxnan"})
        expect_refused(small_render({"--size", value}), 2, "is not WxH, such as 640x480");
    for (const char* value : {"1,2", "1,2,3,4", "a,b,c", "1,,3"})
        expect_refused(small_render({"--eye", value}), 2, "--eye");
    for (const char* value : {"32,0", "0,16", "-1,0", "1"})
        expect_refused(
            {"probe", "builtin:cloth:500", "--frame", "0", "--size", "32x16", "--pixel", value}, 2,
            "--pixel");
    for (const char* value : {"25", "nan"})
        expect_refused(words("probe builtin:cloth:500 --pixel 0,0 --frame", {value}), 2, "--frame");
    for (const char* value : {"every:0", "atuo"})
        expect_refused(small_render({"--update", value}), 2, "--update");
    for (const char* value : {"refit,", ",", "refit auto"})
        expect_refused({"profile", "builtin:cloth:500", "--policies", value}, 2, "--policies");
    expect_refused(small_render({"--size", "65537x1"}), 6, "65536");
    expect_refused(small_render({"--size", "65536x65536"}), 6, "smaller");
}

TEST(Usage, ImpossibleCamerasAndFramesMakeNoFolder) {
    const TemporaryFolder folder;
    const auto refused = [&](Words more, int code, const std::string& text) {
        more.insert(more.begin(), {"render", "builtin:cloth:500", "--backend", "cpu", "--out",
                                   folder.file("a/b/out")});
        expect_refused(more, code, text);
        EXPECT_TRUE(folder.names().empty());
    };
    refused({"--fov", "180"}, 3, "");
    refused({"--eye", "1,2,3", "--target", "1,2,3"}, 3, "");
    for (const char* frames : {"5..2", "0..4:0", "a..b", "0..", "nan", "0..inf", "-1", "0..25",
                               "0,", "7,0", "0,0", "0,all"})
        refused({"--frames", frames}, 2, "frame");
}

TEST(Usage, ImagesOfOtherKindsAreRefusedAndMakeNoFolder) {
    const TemporaryFolder folder;
    const auto render_to = [&](const std::string& out) {
        return words("render builtin:cloth:500 --frame 0 --backend cpu --size 8x8 --out " + out);
    };
    for (const char* name : {"x.jpg", "x.exr"})
        expect_refused(render_to(folder.file(name)), 2, ".png file");
    for (const char* name : {"x.mp4", "x.GIF", "x.webp"})
        expect_refused(render_to(folder.file(name)), 2, "docs/guide/start.md");
    expect_refused(render_to("-"), 2, "no name of a folder");
    expect_refused({"chart", "builtin:cloth:500", "--out", folder.file("x.svg")}, 2, "folder");
    EXPECT_TRUE(folder.names().empty());
    EXPECT_EQ(run(render_to(folder.file("x.PNG"))).code, 0);
    EXPECT_TRUE(std::filesystem::is_regular_file(folder.file("x.PNG")));
}

TEST(Usage, NegativeCoordinatesAreValuesNotOptions) {
    TemporaryFolder folder;
    const Outcome outcome =
        run({"render", "builtin:cloth:500", "--backend", "cpu", "--size", "8x8", "--frames", "0",
             "--eye", "-3,-.5,2", "--target", "-.1,0,0", "--out", folder.file("out")});
    EXPECT_EQ(outcome.code, 0) << outcome.err;
}

TEST(Usage, ControlCharactersInArgumentsDoNotReachTheTerminal) {
    const Outcome outcome = run({"info", "no\x1b[31m\nsuch.obj"});
    EXPECT_EQ(outcome.code, 3);
    EXPECT_EQ(outcome.err.find('\x1b'), std::string::npos);
    EXPECT_EQ(lines(outcome.err).size(), 1u);
}

Words commands() {
    Words names;
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

Words examples_of(const std::string& command) {
    Words examples;
    bool listed = false;
    for (const std::string& line : lines(help_of(command))) {
        if (listed) examples.push_back(line.substr(2));
        listed = listed || line == "Examples:";
    }
    return examples;
}

/// The line with a small scene and image, and with what this build has. Words of files stay.
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
    Words arguments = words(pipe == std::string::npos ? line : line.substr(pipe + 3));
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
            const Words text = lines(run({command, flag}).out);
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
