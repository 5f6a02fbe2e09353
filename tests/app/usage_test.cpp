// Messages about command lines that are refused.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <iterator>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "tests/app/program.h"

namespace mray::test {
namespace {

// Fails with this code and one line on stderr that holds the text; nothing on stdout.
void expect_refused(const std::vector<std::string>& arguments, int code, const std::string& text) {
    const Outcome outcome = run(arguments);
    EXPECT_EQ(outcome.code, code) << outcome.err;
    EXPECT_EQ(outcome.out, "");
    EXPECT_EQ(lines(outcome.err).size(), 1u) << outcome.err;
    EXPECT_NE(outcome.err.find(text), std::string::npos) << outcome.err;
}

std::vector<std::string> small_render(std::vector<std::string> more) {
    // The folder cannot be made: a test that got as far as writing would fail with 5.
    std::vector<std::string> all = {"render", "builtin:cloth:500", "--backend", "cpu",
                                    "--out",  "/dev/null/out"};
    all.insert(all.end(), more.begin(), more.end());
    return all;
}

TEST(Usage, MissingArgumentsAndValuesAreNamed) {
    expect_refused({}, 2, "subcommand is required");
    expect_refused({"crosscheck"}, 2, "SCENES is required");
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
    expect_refused(small_render({"--size", "65537x1"}), 6, "65536");
    expect_refused(small_render({"--size", "65536x65536"}), 6, "smaller");
}

TEST(Usage, ImpossibleCamerasAndFramesMakeNoFolder) {
    const TemporaryFolder folder;
    const auto refused = [&](std::vector<std::string> more, int code, const std::string& text) {
        more.insert(more.begin(), {"render", "builtin:cloth:500", "--backend", "cpu", "--out",
                                   folder.file("out")});
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
        return std::vector<std::string>{"render",    "builtin:cloth:500",
                                        "--frame",   "0",
                                        "--backend", "cpu",
                                        "--size",    "8x8",
                                        "--out",     out};
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

}  // namespace
}  // namespace mray::test
