// SIGINT and SIGTERM in the middle of a render.
#include <gtest/gtest.h>
#include <signal.h>

#include <chrono>
#include <nlohmann/json.hpp>
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

/// One frame takes minutes.
std::vector<std::string> long_frame(const std::string& out) {
    return {"render",    "builtin:cloth:20000",
            "--backend", "brute",
            "--size",    "4096x4096",
            "--rays",    "shadow",
            "--frames",  "0",
            "--out",     out};
}

TEST(Signals, InterruptKeepsWholeFramesOnly) {
    TemporaryFolder folder;
    const TemporaryFolder reports;
    std::vector<std::string> line = long_render(folder.file("out"));
    line.insert(line.end(), {"--json", reports.file("r.json")});
    Started render(line);
    wait_for(folder.path() / "out/frame_0000.00000.png");
    render.send(SIGINT);
    const Outcome outcome = render.wait();
    EXPECT_EQ(outcome.code, 130);
    // The report is about the images that are there.
    const auto json = nlohmann::json::parse(read_file(reports.file("r.json")));
    EXPECT_EQ(json["complete"], false);
    EXPECT_EQ(json["error"], "interrupted; finished results are kept");
    EXPECT_FALSE(json["frames"].empty());
    for (const auto& frame : json["frames"])
        EXPECT_TRUE(std::filesystem::exists(folder.path() / "out" / std::string(frame["file"])));
    EXPECT_EQ(lines(outcome.err).size(), 1u) << outcome.err;
    EXPECT_FALSE(std::filesystem::exists(folder.path() / "out/frame_0024.00000.png"));
    expect_whole_images_only(folder);
}

TEST(Signals, InterruptEndsWithinAFrameWithoutAnImage) {
    for (const auto& [signal, code] : {std::pair{SIGINT, 130}, {SIGTERM, 143}, {SIGHUP, 129}}) {
        TemporaryFolder folder;
        Started render(long_frame(folder.file("out")));
        wait_for(folder.path() / "out");
        std::this_thread::sleep_for(std::chrono::milliseconds(500));
        render.send(signal);
        EXPECT_EQ(render.wait().code, code);
        EXPECT_TRUE(std::filesystem::is_empty(folder.path() / "out"));
    }
}

}  // namespace
}  // namespace mray::test
