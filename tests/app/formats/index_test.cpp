// Index files, given bounds and clips that are read frame by frame, as a user meets them.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cstring>
#include <nlohmann/json.hpp>

#include "tests/app/program.h"
#include "tests/app/scenes.h"

namespace mray::test {
namespace {

using Json = nlohmann::json;

constexpr int kFrames = 6;

void write_clip(const TemporaryFolder& folder) {
    for (int i = 0; i < kFrames; ++i)
        folder.write(fmt::format("clip/f_{}.obj", i), square_at(0.25 * i));
}

/// The clip as a PC2 file beside a mesh.
void write_cache(const TemporaryFolder& folder) {
    folder.write("mesh.obj", square_at(0));
    std::string bytes("POINTCACHE2\0", 12);
    const auto add = [&bytes](auto value) {
        bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
    };
    add(std::uint32_t{1});
    add(std::uint32_t{4});
    add(0.0f);
    add(1.0f);
    add(std::uint32_t{kFrames});
    for (int i = 0; i < kFrames; ++i) {
        const float x = 0.25f * static_cast<float>(i);
        for (const float value :
             {x - 1, -1.0f, 0.0f, x + 1, -1.0f, 0.0f, x + 1, 1.0f, 0.0f, x - 1, 1.0f, 0.0f})
            add(value);
    }
    folder.write("cloth.pc2", bytes);
}

Outcome call(std::vector<std::string> arguments, const TemporaryFolder& folder) {
    return run(arguments, {.folder = folder.path()});
}

/// The hashes of images and hits of all frames.
std::vector<std::string> hashes(const TemporaryFolder& folder, std::vector<std::string> more,
                                std::string* err = nullptr) {
    std::vector<std::string> all = {"render",   "--backend", "cpu", "--size",
                                    "32x24",    "--samples", "1",   "--frames",
                                    "0..5:0.5", "--json",    "-",   "--quiet"};
    all.insert(all.end(), more.begin(), more.end());
    const Outcome outcome = call(all, folder);
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    if (err != nullptr) *err = outcome.err;
    std::vector<std::string> result;
    const Json report = Json::parse(outcome.out);
    for (const Json& frame : report["frames"]) {
        result.push_back(frame["image_hash"]);
        result.push_back(frame["hits_hash"]);
    }
    return result;
}

TEST(Index, ChangesNoBitOfAnImage) {
    const TemporaryFolder folder;
    write_clip(folder);
    write_cache(folder);
    using Words = std::vector<std::string>;
    for (const Words& scene :
         {Words{"clip"}, Words{"clip/f_%d.obj"}, Words{"mesh.obj", "--cache", "cloth.pc2"}}) {
        std::string err;
        const std::vector<std::string> without = hashes(folder, scene, &err);
        EXPECT_EQ(err, "");
        Words make = {"index"};
        make.insert(make.end(), scene.begin(), scene.end());
        const Outcome made = call(make, folder);
        EXPECT_EQ(made.code, 0) << made.err;
        EXPECT_NE(made.out.find(".mrindex: 6 frames of 4 vertices\n"), std::string::npos)
            << made.out;
        EXPECT_EQ(hashes(folder, scene, &err), without);
        EXPECT_EQ(err, "");
        Words info = {"info"};
        info.insert(info.end(), scene.begin(), scene.end());
        EXPECT_NE(call(info, folder).out.find("index           used: "), std::string::npos);
    }
}

TEST(Index, ThatIsStaleIsAWarningAndChangesNothing) {
    const TemporaryFolder folder;
    write_clip(folder);
    EXPECT_EQ(call({"index", "clip"}, folder).code, 0);
    folder.write("clip/f_3.obj", square_at(7));
    std::string err;
    const std::vector<std::string> with = hashes(folder, {"clip"}, &err);
    EXPECT_EQ(err,
              "clip.mrindex: warning: the index is not used, and all frames are read: f_3.obj "
              "has changed since; write it again by `morphray index`\n");
    EXPECT_EQ(hashes(folder, {"clip", "--index", "none"}, &err), with);
    EXPECT_EQ(err, "");
    const Outcome info = call({"info", "clip", "--json", "-"}, folder);
    EXPECT_EQ(Json::parse(info.out)["index"]["state"], "stale");
    EXPECT_EQ(call({"index", "clip"}, folder).code, 0);
    EXPECT_EQ(hashes(folder, {"clip"}, &err), with);
    EXPECT_EQ(err, "");
}

TEST(Index, ThatIsWrongIsAnErrorAndNotAWrongImage) {
    const TemporaryFolder folder;
    write_clip(folder);
    EXPECT_EQ(call({"index", "clip"}, folder).code, 0);
    const std::filesystem::path file = folder.file("clip/f_3.obj");
    const auto time = std::filesystem::last_write_time(file);
    const std::string text = read_file(file);
    std::string other = text;
    other[other.find("v -0.25") + 3] = '9';
    folder.write("clip/f_3.obj", other);
    std::filesystem::last_write_time(file, time);
    const Outcome outcome = call({"render", "clip", "--backend", "cpu", "--size", "8x8"}, folder);
    EXPECT_EQ(outcome.code, 8);
    EXPECT_TRUE(
        outcome.err.starts_with("clip.mrindex: tells otherwise of frame 3 than clip/f_3.obj"))
        << outcome.err;
    EXPECT_TRUE(std::filesystem::exists(folder.file("out/frame_0002.png")));
    EXPECT_FALSE(std::filesystem::exists(folder.file("out/frame_0003.png")));
    const Outcome verified = call({"index", "clip", "--verify"}, folder);
    EXPECT_EQ(verified.code, 1);
    EXPECT_EQ(verified.out, "clip.mrindex: f_3.obj: other content\n");
}

TEST(Index, IsVerified) {
    const TemporaryFolder folder;
    write_clip(folder);
    EXPECT_EQ(call({"index", "clip", "--verify"}, folder).code, 3);
    EXPECT_EQ(call({"index", "clip", "-o", "here"}, folder).code, 0);
    const Outcome right = call({"index", "clip", "--verify", "-o", "here"}, folder);
    EXPECT_EQ(right.code, 0) << right.err;
    EXPECT_EQ(right.out, "here: is right for 6 frames\n");
    folder.write("clip/f_6.obj", square_at(0));
    EXPECT_EQ(call({"index", "clip", "--verify", "-o", "here"}, folder).code, 1);
    folder.write("here", "MRINDEX\n");
    EXPECT_EQ(call({"index", "clip", "--verify", "-o", "here"}, folder).code, 3);
}

TEST(Index, IsWrittenOverAnIndexOnly) {
    const TemporaryFolder folder;
    write_clip(folder);
    const std::string frame = read_file(folder.file("clip/f_0.obj"));
    EXPECT_EQ(call({"index", "clip", "-o", "clip/f_0.obj"}, folder).code, 5);
    EXPECT_EQ(read_file(folder.file("clip/f_0.obj")), frame);
    EXPECT_EQ(call({"index", "clip", "-o", "clip"}, folder).code, 5);
    EXPECT_EQ(call({"index", "clip", "-o", "no/such/folder"}, folder).code, 5);
    EXPECT_EQ(call({"index", "clip"}, folder).code, 0);
    EXPECT_EQ(call({"index", "clip"}, folder).code, 0);
}

TEST(Index, IsForClips) {
    const TemporaryFolder folder;
    folder.write("one.obj", square_at(0));
    EXPECT_EQ(call({"index", "one.obj"}, folder).code, 3);
    EXPECT_EQ(call({"index", "builtin:cloth:300"}, folder).code, 3);
    EXPECT_EQ(call({"index", "nothing"}, folder).code, 3);
    EXPECT_EQ(folder.names(), std::vector<std::string>{"one.obj"});
}

TEST(Bounds, OpenAClipWithoutReadingIt) {
    const TemporaryFolder folder;
    write_clip(folder);
    const std::vector<std::string> expected = hashes(folder, {"clip"});
    EXPECT_EQ(hashes(folder, {"clip", "--bounds", "-1,-1,0,2.25,1,0"}), expected);
    folder.write("clip/f_5.obj", "nothing");
    const Outcome outcome = call({"render", "clip", "--frame", "2", "--bounds", "-1,-1,0,2.25,1,0",
                                  "--size", "8x8", "--backend", "cpu"},
                                 folder);
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    EXPECT_EQ(outcome.err, "");
}

TEST(Bounds, ThatAFrameLeavesAreAnErrorOfThatFrame) {
    const TemporaryFolder folder;
    write_clip(folder);
    const Outcome outcome =
        call({"render", "clip", "--bounds", "-1,-1,0,2,1,0", "--size", "8x8", "--backend", "cpu"},
             folder);
    EXPECT_EQ(outcome.code, 8);
    EXPECT_NE(outcome.err.find("clip/f_5.obj: frame 5 reaches from 0.25 to 2.25 in x, beyond the "
                               "bounds that were given, -1 to 2"),
              std::string::npos)
        << outcome.err;
    EXPECT_TRUE(std::filesystem::exists(folder.file("out/frame_0004.png")));
}

TEST(Bounds, ThatAreNoneAreUsageErrors) {
    const TemporaryFolder folder;
    write_clip(folder);
    for (const char* const bounds :
         {"", "1", "0,0,0,1,1", "0,0,0,1,1,1,1", "0,0,0,-1,1,1", "nan,0,0,1,1,1", "0,0,0,1,1,inf",
          "0,0,0,1,1,1e39", "a,b,c,d,e,f"}) {
        const Outcome outcome = call({"info", "clip", "--bounds", bounds}, folder);
        EXPECT_EQ(outcome.code, 2) << bounds;
        EXPECT_NE(outcome.err.find("--bounds"), std::string::npos) << outcome.err;
    }
    EXPECT_EQ(call({"info", "builtin:cloth", "--bounds", "0,0,0,1,1,1"}, folder).code, 2);
    EXPECT_EQ(call({"info", "clip", "--bounds", "0,0,0,1,1,1", "--index", "none"}, folder).code, 2);
}

TEST(Pipeline, ReportsWhatWasWaitedFor) {
    const TemporaryFolder folder;
    write_clip(folder);
    const Outcome outcome =
        call({"render", "clip", "--backend", "cpu", "--size", "16x16", "--json", "-", "--quiet"},
             folder);
    ASSERT_EQ(outcome.code, 0) << outcome.err;
    const Json report = Json::parse(outcome.out);
    for (const Json& frame : report["frames"]) {
        for (const char* const key : {"read_wait_ms", "write_wait_ms"}) EXPECT_GE(frame[key], 0.0);
        EXPECT_GT(frame["write_ms"], 0.0);
        EXPECT_GT(frame["deform_ms"], 0.0);
    }
}

TEST(Pipeline, WritesWhatCameBeforeAFrameThatCannotBeRead) {
    const TemporaryFolder folder;
    write_clip(folder);
    folder.write("clip/f_4.obj", "v 1 2\n");
    const Outcome outcome = call({"render", "clip", "--backend", "cpu", "--size", "16x16", "--hits",
                                  "hits", "--json", "report"},
                                 folder);
    EXPECT_EQ(outcome.code, 8) << outcome.err;
    for (int i = 0; i < kFrames; ++i) {
        EXPECT_EQ(std::filesystem::exists(folder.file(fmt::format("out/frame_{:04}.png", i))),
                  i < 4);
    }
    const Json report = Json::parse(read_file(folder.file("report")));
    EXPECT_EQ(report["complete"], false);
    EXPECT_EQ(report["frames"].size(), 4u);
}

TEST(Pipeline, EndsWhenAnImageCannotBeWritten) {
    const TemporaryFolder folder;
    write_clip(folder);
    std::filesystem::create_directories(folder.file("out/frame_0002.png"));
    const Outcome outcome =
        call({"render", "clip", "--backend", "cpu", "--size", "16x16", "--json", "report"}, folder);
    EXPECT_EQ(outcome.code, 5) << outcome.err;
    EXPECT_EQ(lines(outcome.err).size(), 1u) << outcome.err;
    EXPECT_TRUE(std::filesystem::exists(folder.file("out/frame_0001.png")));
    EXPECT_FALSE(std::filesystem::exists(folder.file("out/frame_0003.png")));
    EXPECT_FALSE(std::filesystem::exists(folder.file("report")));
}

}  // namespace
}  // namespace mray::test
