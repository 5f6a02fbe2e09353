// SIGINT and SIGTERM in the middle of a render.
#include <gtest/gtest.h>
#include <signal.h>

#include <chrono>
#include <thread>

#include "tests/app/program.h"

namespace mray::test {
namespace {

// Brute force over a few thousand triangles: a fraction of a second a frame, more than a minute in
// all.
std::vector<std::string> long_render(const std::string& out) {
    return {"render", "builtin:cloth:4000", "--backend",     "brute", "--size", "96x96", "--rays",
            "shadow", "--frames",           "0..24:0.03125", "--out", out};
}

void wait_for(const std::filesystem::path& file) {
    for (int i = 0; i < 3000 && !std::filesystem::exists(file); ++i) {
        std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    ASSERT_TRUE(std::filesystem::exists(file)) << file;
}

// Every file is a whole PNG: signature first, IEND last.
void expect_whole_images_only(const TemporaryFolder& folder) {
    for (const std::string& name : folder.names()) {
        if (name == "out") continue;
        const std::string png = read_file(folder.path() / name);
        EXPECT_TRUE(name.starts_with("out/frame_") && name.ends_with(".png")) << name;
        EXPECT_TRUE(png.starts_with("\x89PNG")) << name;
        EXPECT_EQ(png.find("IEND"), png.size() - 8) << name;
    }
}

TEST(Signals, InterruptKeepsWholeFramesOnly) {
    TemporaryFolder folder;
    Started render(long_render(folder.file("out")));
    wait_for(folder.path() / "out/frame_0000.00000.png");
    render.send(SIGINT);
    const Outcome outcome = render.wait();
    EXPECT_EQ(outcome.code, 130);
    EXPECT_EQ(lines(outcome.err).size(), 1u) << outcome.err;
    EXPECT_FALSE(std::filesystem::exists(folder.path() / "out/frame_0024.00000.png"));
    expect_whole_images_only(folder);
}

TEST(Signals, TerminateGivesExitCode143) {
    TemporaryFolder folder;
    Started render(long_render(folder.file("out")));
    wait_for(folder.path() / "out/frame_0000.00000.png");
    render.send(SIGTERM);
    EXPECT_EQ(render.wait().code, 143);
    expect_whole_images_only(folder);
}

// One frame takes minutes.
TEST(Signals, TerminateEndsWithinAFrame) {
    TemporaryFolder folder;
    std::filesystem::create_directory(folder.path() / "out");
    Started render({"render", "builtin:cloth:20000", "--backend", "brute", "--size", "4096x4096",
                    "--rays", "shadow", "--frames", "0", "--out", folder.file("out")});
    std::this_thread::sleep_for(std::chrono::seconds(1));
    render.send(SIGTERM);
    const Outcome outcome = render.wait();
    EXPECT_EQ(outcome.code, 143);
    EXPECT_EQ(lines(outcome.err).size(), 1u) << outcome.err;
    EXPECT_NE(outcome.err.find("terminated"), std::string::npos) << outcome.err;
    EXPECT_EQ(folder.names(), std::vector<std::string>{"out"});
}

TEST(Signals, TerminateEndsATreeThatIsBuilt) {
    TemporaryFolder folder;
    std::filesystem::create_directory(folder.path() / "out");
    // The tree takes half a minute.
    Started render({"render", "builtin:hair:4000000", "--frames", "0", "--build", "sweep",
                    "--threads", "1", "--size", "64x64", "--out", folder.file("out")});
    std::this_thread::sleep_for(std::chrono::seconds(1));
    render.send(SIGTERM);
    const Outcome outcome = render.wait();
    EXPECT_EQ(outcome.code, 143);
    EXPECT_EQ(lines(outcome.err).size(), 1u) << outcome.err;
    EXPECT_NE(outcome.err.find("terminated"), std::string::npos) << outcome.err;
    EXPECT_EQ(folder.names(), std::vector<std::string>{"out"});
}

TEST(Signals, TerminateEndsTheReadingOfAFile) {
    TemporaryFolder folder;
    std::string text;
    for (int i = 0; i < 3'000'000; ++i) text += "v 0.125 1.25 2.5\n";
    for (int i = 1; i < 3'000'000 - 3; ++i)
        text += "f " + std::to_string(i) + " " + std::to_string(i + 1) + " " +
                std::to_string(i + 2) + "\n";
    const std::string file = folder.write("large.obj", text);
    Started render({"info", file});
    render.send(SIGTERM);
    EXPECT_EQ(render.wait().code, 143);
    EXPECT_EQ(folder.names(), std::vector<std::string>{"large.obj"});
}

TEST(Signals, InterruptOfTraceLeavesNoFile) {
    TemporaryFolder folder;
    std::string rays;
    for (int i = 0; i < 2'000'000; ++i) rays += "0 5 0 0 -1 0\n";
    const std::string file = folder.write("rays", rays);
    Started trace({"trace", "builtin:cloth:4000", "--backend", "brute", "--rays", file, "--out",
                   folder.file("answers")});
    std::this_thread::sleep_for(std::chrono::milliseconds(500));
    trace.send(SIGTERM);
    EXPECT_EQ(trace.wait().code, 143);
    EXPECT_EQ(folder.names(), std::vector<std::string>{"rays"});
}

}  // namespace
}  // namespace mray::test
