// Long runs: signals, the line of progress on a terminal, and rows of tables as they are made.
#include <gtest/gtest.h>
#include <signal.h>

#include <chrono>
#include <thread>

#include <nlohmann/json.hpp>

#include "tests/app/program.h"

namespace mray::test {
namespace {

void wait_for(const std::filesystem::path& file) {
    for (int i = 0; i < 3000 && !std::filesystem::exists(file); ++i) {
        std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    ASSERT_TRUE(std::filesystem::exists(file)) << file;
}

TEST(Signals, InterruptKeepsWholeFramesOnlyWithTheirRows) {
    TemporaryFolder folder;
    const TemporaryFolder reports;
    const std::string out = folder.file("out");
    // A fraction of a second a frame, more than a minute in all.
    Started render(
        words("render builtin:cloth:4000 --backend brute --size 96x96 --rays shadow "
              "--frames 0,3..24:0.03125 --out " +
              out + " --json " + reports.file("r.json")));
    // Rows are written as frames are made.
    render.wait_for_out(R"(\n +3 .*\n)");
    render.send(SIGINT);
    const Outcome outcome = render.wait();
    EXPECT_EQ(outcome.code, 130);
    EXPECT_EQ(outcome.err, "morphray: interrupted; finished results are kept\n");
    const Words rows = lines(outcome.out);
    ASSERT_GE(rows.size(), 3u) << outcome.out;
    EXPECT_TRUE(has(rows[0], "frame  tree ")) << rows[0];
    // Each is of a file that is there, and no file lacks one.
    EXPECT_EQ(folder.names().size() - 1, rows.size() - 1);
    for (std::size_t i = 1; i < rows.size(); ++i)
        EXPECT_TRUE(std::filesystem::exists(rows[i].substr(rows[i].find(out)))) << rows[i];
    // The report is about the images that are there.
    const auto json = nlohmann::json::parse(read_file(reports.file("r.json")));
    EXPECT_EQ(json["complete"], false);
    EXPECT_EQ(json["error"], "interrupted; finished results are kept");
    EXPECT_FALSE(json["frames"].empty());
    for (const auto& frame : json["frames"])
        EXPECT_TRUE(std::filesystem::exists(folder.path() / "out" / std::string(frame["file"])));
    EXPECT_FALSE(std::filesystem::exists(folder.path() / "out/frame_0024.00000.png"));
    // Every file is a whole PNG: signature first, IEND last.
    for (const std::string& name : folder.names()) {
        if (name == "out") continue;
        const std::string png = read_file(folder.path() / name);
        EXPECT_TRUE(name.starts_with("out/frame_") && name.ends_with(".png")) << name;
        EXPECT_TRUE(png.starts_with("\x89PNG")) << name;
        EXPECT_EQ(png.find("IEND"), png.size() - 8) << name;
    }
}

TEST(Signals, InterruptEndsWithinAFrameWithoutAnImage) {
    for (const auto& [signal, code] : {std::pair{SIGINT, 130}, {SIGTERM, 143}, {SIGHUP, 129}}) {
        TemporaryFolder folder;
        // The frame takes minutes.
        Started render(
            words("render builtin:cloth:20000 --backend brute --size 4096x4096 --rays shadow "
                  "--frames 0 --out " +
                  folder.file("out")));
        wait_for(folder.path() / "out");
        std::this_thread::sleep_for(std::chrono::milliseconds(500));
        render.send(signal);
        EXPECT_EQ(render.wait().code, code);
        EXPECT_TRUE(std::filesystem::is_empty(folder.path() / "out"));
    }
}

constexpr const char* kClearLine = "\r\x1b[K";

TEST(LiveLine, ShowsTheStepAndIsClearedBeforeTheMessage) {
    const TemporaryFolder folder;
    // Each takes long enough to be seen at work, on any machine.
    for (const auto& [command, line] :
         {std::pair("render builtin:cloth:20000 --backend brute --size 1024x1024 --rays shadow "
                    "--frames 3..24 --out ",
                    R"(rendering \d+/22  frame \d+, \d+%, \d\d:\d\d:\d\d to go)"),
          {"render builtin:soup:4000000 --backend cpu --threads 1 --size 8x8 --frame 0 --out ",
           R"(rendering 0/1  tree)"}}) {
        Started started(words(command + folder.file("out")),
                        {.environment = {"TERM=xterm", "NO_COLOR=1"}, .on_terminal = true});
        started.wait_for_err(line);
        started.send(SIGTERM);
        const Outcome outcome = started.wait();
        EXPECT_EQ(outcome.code, 143) << outcome.err;
        EXPECT_EQ(outcome.out, "");
        // A single line at the end, of which nothing is left but the message.
        const std::size_t cleared = outcome.err.rfind(kClearLine);
        ASSERT_NE(cleared, std::string::npos);
        const std::string message = outcome.err.substr(cleared + 4);
        EXPECT_TRUE(message.starts_with("morphray: terminated; ")) << outcome.err;
        EXPECT_EQ(message.find('\n'), message.size() - 1) << message;
        EXPECT_EQ(outcome.err.find('\n'), outcome.err.size() - 1) << outcome.err;
    }
}

TEST(Rows, OfProfileEndNoReportIfTheyCannotBePrinted) {
    for (const char* policies : {"", "--policies refit"}) {
        const TemporaryFolder folder;
        const Outcome outcome =
            run(words("profile builtin:cloth:500 --backend cpu --size 8x8 --frames 0..1 --repeat 1 "
                      "--json " +
                      folder.file("profile.json ") + policies),
                {.stdout_to = "/dev/full"});
        EXPECT_EQ(outcome.code, 5) << outcome.err;
        EXPECT_TRUE(std::filesystem::exists(folder.file("profile.json")));
    }
}

}  // namespace
}  // namespace mray::test
