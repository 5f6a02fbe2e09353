// render --shard and --skip-existing.
#include <signal.h>

#include <chrono>
#include <regex>
#include <thread>

#include "tests/app/farm/farm.h"

namespace mray::test {
namespace {

std::string frame_name(int frame, const char* end = "png") {
    return "frame_000" + std::to_string(frame) + '.' + end;
}

void expect_same_images(const TemporaryFolder& folder, const std::string& expected,
                        const std::string& actual, const char* end = "png") {
    for (int frame = 0; frame < 8; ++frame) {
        const std::string bytes = read_file(folder.path() / expected / frame_name(frame, end));
        EXPECT_FALSE(bytes.empty()) << frame;
        EXPECT_TRUE(bytes == read_file(folder.path() / actual / frame_name(frame, end))) << frame;
    }
}

TEST(Shards, WriteTheFilesOfOneRun) {
    const TemporaryFolder folder;
    ASSERT_EQ(run(render_of(folder, "one")).code, 0);
    render_shards(folder, "three", 3);
    expect_same_images(folder, "one", "three");
    // Each frame was rendered by one shard alone.
    std::size_t frames = 0;
    for (int i = 1; i <= 3; ++i)
        frames +=
            read_json(folder, "three/part-" + std::to_string(i) + "-of-3.json")["frames"].size();
    EXPECT_EQ(frames, 8u);
    EXPECT_FALSE(std::filesystem::exists(folder.path() / "three/sheet.png"));
}

TEST(Shards, OfListsOfFramesAreMerged) {
    const TemporaryFolder folder;
    const auto shard = [&](const std::string& number, const char* frames) {
        return run({"render", "builtin:cloth:300", "--backend", "cpu", "--size", "24x20",
                    "--frames", frames, "--shard", number, "--out", folder.file("out")});
    };
    EXPECT_EQ(shard("1/2", "0..4:2,7,20.5").code, 0);
    EXPECT_EQ(shard("2/2", "0..4:2,7,20.5").code, 0);
    const Outcome merged = merge(folder, {"out", "--json", "-"});
    EXPECT_EQ(merged.code, 0) << merged.out << merged.err;
    std::vector<double> frames;
    const Json report = Json::parse(merged.out);
    for (const Json& frame : report["frames"]) frames.push_back(frame["frame"]);
    EXPECT_EQ(frames, (std::vector<double>{0, 2, 4, 7, 20.5}));
    // A shard of other frames does not fit.
    EXPECT_EQ(shard("2/2", "0..4:2,7,20").code, 0);
    EXPECT_NE(merge(folder, {"out"}).code, 0);
}

TEST(Shards, WriteTheHitsAndOpenExrFilesOfOneRun) {
    const TemporaryFolder folder;
    const auto with = [&](const std::string& hits) {
        return Names{"--hits", folder.file(hits) + '/', "--exr", "half"};
    };
    auto lit = [](Names arguments) {
        const auto rays = std::find(arguments.begin(), arguments.end(), "--rays");
        arguments.erase(rays, rays + 2);
        return arguments;
    };
    ASSERT_EQ(run(lit(render_of(folder, "one", with("one_hits")))).code, 0);
    for (const char* shard : {"1/2", "2/2"}) {
        Names more = with("hits");
        more.insert(more.end(), {"--shard", shard});
        ASSERT_EQ(run(lit(render_of(folder, "two", more))).code, 0);
    }
    expect_same_images(folder, "one", "two");
    expect_same_images(folder, "one", "two", "exr");
    expect_same_images(folder, "one_hits", "hits", "hits");
    const Outcome merged = merge(folder, {"two"});
    EXPECT_EQ(merged.code, 0) << merged.out << merged.err;
    // Another file of hits is not what the part says.
    std::filesystem::copy_file(folder.path() / "hits/frame_0001.hits",
                               folder.path() / "hits/frame_0002.hits",
                               std::filesystem::copy_options::overwrite_existing);
    const Outcome damaged = merge(folder, {"two"});
    EXPECT_EQ(damaged.code, 1);
    EXPECT_NE(damaged.out.find("frame 2 of shard 1 on "), std::string::npos) << damaged.out;
}

TEST(Shards, MayBeMoreThanFrames) {
    const TemporaryFolder folder;
    render_shards(folder, "out", 10, {"--verify-every", "4"});
    const Outcome merged = merge(folder, {"out"});
    EXPECT_EQ(merged.code, 0) << merged.out << merged.err;
    EXPECT_TRUE(read_json(folder, "out/part-1-of-10.json")["frames"].empty());
}

TEST(Shards, TreeColoursAreThoseOfOneRun) {
    const TemporaryFolder folder;
    for (const char* update : {"refit", "rebuild"}) {
        auto steps = [&](Names arguments) {
            const auto rays = std::find(arguments.begin(), arguments.end(), "--rays");
            arguments.erase(rays, rays + 2);
            arguments.insert(arguments.end(), {"--shading", "steps", "--update", update});
            return arguments;
        };
        const std::string one = std::string("one_") + update;
        const std::string shards = std::string("shards_") + update;
        ASSERT_EQ(run(steps(render_of(folder, one))).code, 0);
        for (const char* shard : {"1/3", "2/3", "3/3"})
            ASSERT_EQ(run(steps(render_of(folder, shards, {"--shard", shard}))).code, 0);
        expect_same_images(folder, one, shards);
    }
}

TEST(Shards, RefuseWhatWouldDifferFromOneRun) {
    const TemporaryFolder folder;
    const auto code_of = [&](Names more) {
        const Outcome outcome = run(
            [&] {
                Names all = {"render", "builtin:cloth:300"};
                all.insert(all.end(), more.begin(), more.end());
                return all;
            }(),
            {.folder = folder.path()});
        EXPECT_EQ(lines(outcome.err).size(), 1u) << outcome.err;
        return outcome.code;
    };
    EXPECT_EQ(code_of({"--shard", "1/2", "--shading", "steps"}), 2);
    EXPECT_EQ(code_of({"--skip-existing", "--shading", "sah", "--update", "every:3"}), 2);
    EXPECT_EQ(code_of({"--shard", "1/2", "--out", "one.png"}), 2);
    EXPECT_EQ(code_of({"--shard", "1/2", "--hits", "all.hits"}), 2);
    EXPECT_EQ(code_of({"--skip-existing", "--hits", "all.hits"}), 2);
    EXPECT_EQ(code_of({"--verify-every", "3"}), 2);
    EXPECT_EQ(code_of({"--shard", "1/1", "--verify-every", "3"}), 2);
    EXPECT_EQ(code_of({"--shard", "1/2", "--hits", "h\xFF/"}), 2);
    EXPECT_EQ(code_of({"--shard", "3/2"}), 2);
    EXPECT_EQ(code_of({"--shard", "two"}), 2);
    EXPECT_TRUE(folder.names().empty());
}

// ---------------------------------------------------------------- --skip-existing

/// The frames that a run with --skip-existing rendered again.
Names rendered_again(const TemporaryFolder& folder, const std::string& out,
                     const Names& more = {}) {
    Names all = {"--skip-existing", "--json", folder.file("report.json")};
    all.insert(all.end(), more.begin(), more.end());
    const Outcome outcome = run(render_of(folder, out, all));
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    const Json report = read_json(folder, "report.json");
    Names files;
    for (const Json& frame : report["frames"]) files.push_back(frame["file"]);
    EXPECT_EQ(files.size() + report["kept"].size(), 8u);
    return files;
}

TEST(SkipExisting, KeepsWholeImagesAndTheSheet) {
    const TemporaryFolder folder;
    ASSERT_EQ(run(render_of(folder, "out")).code, 0);
    const std::string sheet = read_file(folder.path() / "out/sheet.png");
    EXPECT_TRUE(rendered_again(folder, "out").empty());
    EXPECT_TRUE(read_file(folder.path() / "out/sheet.png") == sheet);
}

TEST(SkipExisting, RendersDamagedImagesAgain) {
    const TemporaryFolder folder;
    ASSERT_EQ(run(render_of(folder, "one")).code, 0);
    ASSERT_EQ(run(render_of(folder, "out")).code, 0);
    const auto change = [&](int frame, auto work) {
        const std::string name = "out/" + frame_name(frame);
        std::string bytes = read_file(folder.path() / name);
        work(bytes);
        folder.write(name, bytes);
    };
    change(0, [](std::string& png) { png.resize(png.size() / 2); });
    change(1, [](std::string& png) { png.resize(png.size() - 1); });
    change(2, [](std::string& png) { png.clear(); });
    change(3, [](std::string& png) { png[png.find("IDAT") + 20] ^= 1; });
    change(4, [](std::string& png) { png[png.find("Image hash") + 16] ^= 1; });
    change(5, [](std::string& png) { png = "text"; });
    std::filesystem::remove(folder.path() / "out" / frame_name(6));
    EXPECT_EQ(rendered_again(folder, "out"),
              (Names{frame_name(0), frame_name(1), frame_name(2), frame_name(3), frame_name(4),
                     frame_name(5), frame_name(6)}));
    expect_same_images(folder, "one", "out");
}

TEST(SkipExisting, RendersImagesOfOtherOptionsAgain) {
    const TemporaryFolder folder;
    ASSERT_EQ(run(render_of(folder, "out")).code, 0);
    EXPECT_EQ(rendered_again(folder, "out", {"--fov", "50"}).size(), 8u);
    EXPECT_TRUE(rendered_again(folder, "out", {"--fov", "50"}).empty());
    EXPECT_EQ(rendered_again(folder, "out", {"--light", "1,2,3"}).size(), 8u);
    // An option that does not change the image is no reason.
    EXPECT_TRUE(rendered_again(folder, "out", {"--light", "1,2,3", "--simd", "off"}).empty());
}

TEST(SkipExisting, RendersColoursOfAnotherTreeAgain) {
    const TemporaryFolder folder;
    const auto kept = [&](const char* update) {
        const Outcome outcome =
            run({"render", "builtin:explode:3000", "--frames", "0..24:8", "--shading", "steps",
                 "--size", "24x20", "--backend", "cpu", "--skip-existing", "--out", "out", "--json",
                 "-", "--update", update},
                {.folder = folder.path()});
        EXPECT_EQ(outcome.code, 0) << outcome.err;
        return Json::parse(outcome.out)["kept"].size();
    };
    EXPECT_EQ(kept("rebuild"), 0u);
    EXPECT_EQ(kept("refit"), 0u);
    EXPECT_EQ(kept("refit"), 4u);
}

/// The file with a text of the same length in place of another, and its chunk's checksum.
std::string with_text(std::string png, const std::string& keyword, const std::string& text) {
    const std::size_t at = png.find("iTXt" + keyword);
    EXPECT_NE(at, std::string::npos);
    std::uint32_t size = 0;
    for (int i = 4; i > 0; --i) size = size << 8 | static_cast<unsigned char>(png[at - i]);
    const std::size_t begin = at + 4 + keyword.size() + 5;
    png.replace(begin, at + 4 + size - begin, text);
    const auto length = static_cast<std::uint32_t>(keyword.size() + 5 + text.size());
    const auto put = [&](std::size_t to, std::uint32_t word) {
        for (int i = 0; i < 4; ++i) png[to + i] = static_cast<char>(word >> (24 - 8 * i));
    };
    put(at - 4, length);
    std::uint32_t crc = 0xFFFFFFFFu;
    for (std::size_t i = at; i < at + 4 + length; ++i) {
        crc ^= static_cast<unsigned char>(png[i]);
        for (int bit = 0; bit < 8; ++bit) crc = crc >> 1 ^ (crc & 1 ? 0xEDB88320u : 0);
    }
    put(at + 4 + length, ~crc);
    return png;
}

TEST(SkipExisting, RendersImagesOfAnotherVersionOrSceneAgain) {
    const TemporaryFolder folder;
    ASSERT_EQ(run(render_of(folder, "out")).code, 0);
    const auto plant = [&](int frame, const char* keyword, const char* text) {
        const std::string name = "out/" + frame_name(frame);
        folder.write(name, with_text(read_file(folder.path() / name), keyword, text));
    };
    plant(2, "Software", "morphray 0.0.1 (abc)");
    plant(5, "Scene hash", "0123456789abcdef");
    EXPECT_EQ(rendered_again(folder, "out"), (Names{frame_name(2), frame_name(5)}));
}

TEST(SkipExisting, RendersFramesAgainWhoseMeshHasChanged) {
    const TemporaryFolder folder;
    const auto mesh = [](double z) {
        return "v 0 0 0\nv 1 0 0\nv 0 1 " + std::to_string(z) + "\nv 9 9 9\nv -9 -9 -9\nf 1 2 3\n";
    };
    for (int i = 0; i < 3; ++i) folder.write("s/f_" + std::to_string(i) + ".obj", mesh(i));
    const Names arguments = {"render", "s",          "--size", "16x16", "--backend",
                             "cpu",    "--out",      "out",    "-q",    "--skip-existing",
                             "--json", "report.json"};
    ASSERT_EQ(run(arguments, {.folder = folder.path()}).code, 0);
    folder.write("s/f_1.obj", mesh(1.5));
    ASSERT_EQ(run(arguments, {.folder = folder.path()}).code, 0);
    const Json report = read_json(folder, "report.json");
    EXPECT_EQ(report["kept"], Json({0.0, 2.0}));
    ASSERT_EQ(report["frames"].size(), 1u);
    EXPECT_EQ(report["frames"][0]["frame"], 1.0);
}

TEST(SkipExisting, NeedsAllOutputsOfAFrame) {
    const TemporaryFolder folder;
    const Names more = {"--hits", folder.file("hits") + '/', "--exr", "half", "--shading", "lit"};
    const auto arguments = [&](const Names& added) {
        Names all = render_of(folder, "out", more);
        const auto rays = std::find(all.begin(), all.end(), "--rays");
        all.erase(rays, rays + 2);
        all.insert(all.end(), {"--samples", "1"});
        all.insert(all.end(), added.begin(), added.end());
        return all;
    };
    ASSERT_EQ(run(arguments({})).code, 0);
    std::filesystem::remove(folder.path() / "out/frame_0001.exr");
    folder.write("out/frame_0002.exr",
                 read_file(folder.path() / "out/frame_0002.exr").substr(0, 900));
    std::filesystem::remove(folder.path() / "hits/frame_0004.hits");
    folder.write("hits/frame_0005.hits",
                 read_file(folder.path() / "hits/frame_0005.hits").substr(0, 100));
    // An OpenEXR file of another frame.
    std::filesystem::copy_file(folder.path() / "out/frame_0000.exr",
                               folder.path() / "out/frame_0007.exr",
                               std::filesystem::copy_options::overwrite_existing);
    ASSERT_EQ(run(arguments({"--skip-existing", "--json", folder.file("report.json")})).code, 0);
    const Json report = read_json(folder, "report.json");
    EXPECT_EQ(report["kept"], Json({0.0, 3.0, 6.0}));
    ASSERT_EQ(run(arguments({"--skip-existing", "--json", folder.file("report.json")})).code, 0);
    EXPECT_EQ(read_json(folder, "report.json")["kept"].size(), 8u);
}

TEST(SkipExisting, KeepsNoHitsOfAnotherImage) {
    const TemporaryFolder folder;
    const Names hits = {"--hits", folder.file("hits") + '/'};
    Names of_another_eye = hits;
    of_another_eye.insert(of_another_eye.end(), {"--eye", "6,4,2"});
    ASSERT_EQ(run(render_of(folder, "out", of_another_eye)).code, 0);
    ASSERT_EQ(run(render_of(folder, "out")).code, 0);
    EXPECT_EQ(rendered_again(folder, "out", hits).size(), 8u);
    std::filesystem::copy_file(folder.path() / "hits/frame_0000.hits",
                               folder.path() / "hits/frame_0003.hits",
                               std::filesystem::copy_options::overwrite_existing);
    EXPECT_EQ(rendered_again(folder, "out", hits), Names{frame_name(3)});
    EXPECT_TRUE(rendered_again(folder, "out", hits).empty());
}

// ---------------------------------------------------------------- parts

TEST(Parts, SayWhatWasDone) {
    const TemporaryFolder folder;
    ASSERT_EQ(render_shard(folder, "out", "2/3", {"--verify-every", "3"}, "node7").code, 0);
    const Json part = read_json(folder, "out/part-2-of-3.json");
    EXPECT_EQ(part["part"], 2);
    EXPECT_EQ(part["parts"], 3);
    EXPECT_EQ(part["host"], "node7");
    EXPECT_EQ(part["backend"], "cpu");
    EXPECT_EQ(part["state"], "done");
    EXPECT_EQ(part["exit_code"], 0);
    EXPECT_EQ(part["all_frames"].size(), 8u);
    EXPECT_TRUE(part["frames_left"].empty());
    ASSERT_EQ(part["frames"].size(), 3u);
    for (const Json& frame : part["frames"]) {
        EXPECT_EQ(frame["host"], "node7");
        EXPECT_GT(frame["total_ms"], 0.0);
        EXPECT_EQ(frame["image_hash"].get<std::string>().size(), 16u);
    }
    // Every third frame of other shards, in a folder of its own.
    ASSERT_EQ(part["checks"].size(), 2u);
    EXPECT_EQ(part["checks"][0]["file"], "check-2-of-3/frame_0000.png");
    EXPECT_EQ(part["checks"][1]["file"], "check-2-of-3/frame_0006.png");
}

TEST(Parts, AreWrittenWhenTheSceneCannotBeRead) {
    const TemporaryFolder folder;
    const Outcome outcome =
        run({"render", "none.obj", "--shard", "1/2", "--out", "out"}, {.folder = folder.path()});
    EXPECT_EQ(outcome.code, 3);
    const Json part = read_json(folder, "out/part-1-of-2.json");
    EXPECT_EQ(part["state"], "failed");
    EXPECT_EQ(part["exit_code"], 3);
    EXPECT_NE(part["reason"].get<std::string>().find("none.obj"), std::string::npos);
}

TEST(Parts, AreWrittenBeforeTheSceneIsRead) {
    const TemporaryFolder folder;
    std::filesystem::create_directories(folder.path() / "out/part-1-of-2.json");
    const Outcome outcome =
        run({"render", "none.obj", "--shard", "1/2", "--out", "out"}, {.folder = folder.path()});
    EXPECT_EQ(outcome.code, 5) << outcome.err;
    EXPECT_NE(outcome.err.find("part-1-of-2.json"), std::string::npos) << outcome.err;
}

TEST(Parts, SayWhichFramesAreLeftAfterABadOne) {
    const TemporaryFolder folder;
    for (int i = 0; i < 4; ++i)
        folder.write("s/f_" + std::to_string(i) + ".obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    folder.write("s/f_3.obj", "v 0 0 0\nv 1 0 0\nv nan 1 0\nf 1 2 3\n");
    const Outcome outcome = run({"render", "s", "--shard", "2/2", "--out", "out", "--size", "16x16",
                                 "--backend", "cpu", "-q"},
                                {.folder = folder.path()});
    EXPECT_EQ(outcome.code, 8) << outcome.err;
    const Json part = read_json(folder, "out/part-2-of-2.json");
    EXPECT_EQ(part["state"], "partial");
    EXPECT_EQ(part["exit_code"], 8);
    EXPECT_EQ(part["frames"].size(), 1u);
    EXPECT_EQ(part["frames_left"], Json({3.0}));
    EXPECT_NE(part["reason"].get<std::string>().find("f_3.obj"), std::string::npos);
}

TEST(Shards, SheetOfManyFramesIsThatOfOneRun) {
    const TemporaryFolder folder;
    const auto rendered = [&](const std::string& out, const Names& more) {
        Names arguments = {"render", "builtin:cloth:200", "--backend",  "cpu",       "--size",
                           "16x16",  "--frames",          "0..24:0.25", "--samples", "1",
                           "--out",  folder.file(out)};
        arguments.insert(arguments.end(), more.begin(), more.end());
        EXPECT_EQ(run(arguments).code, 0);
    };
    rendered("one", {});
    for (const char* shard : {"1/2", "2/2"}) rendered("shards", {"--shard", shard});
    EXPECT_EQ(run({"merge", folder.file("shards"), "--sheet", folder.file("sheet.png")}).code, 0);
    EXPECT_EQ(read_file(folder.file("sheet.png")), read_file(folder.file("one/sheet.png")));
}

class EndedBySignal : public testing::TestWithParam<std::pair<int, int>> {};

TEST_P(EndedBySignal, LeavesAPartAndWholeImages) {
    const auto [signal, code] = GetParam();
    const TemporaryFolder folder;
    const Names arguments = {"render",    "builtin:cloth:4000",
                             "--backend", "brute",
                             "--size",    "96x96",
                             "--rays",    "shadow",
                             "--frames",  "0..24:0.03125",
                             "--shard",   "1/2",
                             "--out",     folder.file("out")};
    Started render(arguments);
    const std::filesystem::path first = folder.path() / "out/frame_0000.00000.png";
    for (int i = 0; i < 3000 && !std::filesystem::exists(first); ++i)
        std::this_thread::sleep_for(std::chrono::milliseconds(10));
    // While it runs, the part says so.
    EXPECT_EQ(read_json(folder, "out/part-1-of-2.json")["state"], "running");
    render.send(signal);
    EXPECT_EQ(render.wait().code, code);
    const Json part = read_json(folder, "out/part-1-of-2.json");
    EXPECT_EQ(part["state"], "interrupted");
    EXPECT_EQ(part["exit_code"], code);
    EXPECT_GE(part["frames"].size(), 1u);
    EXPECT_EQ(part["frames"].size() + part["frames_left"].size(), 384u);
    for (const Json& frame : part["frames"]) {
        const std::string png = read_file(folder.path() / "out" / frame["file"].get<std::string>());
        EXPECT_EQ(png.find("IEND"), png.size() - 8);
    }
    for (const std::string& name : folder.names())
        EXPECT_EQ(name.find(".morphray"), std::string::npos) << name;
}

INSTANTIATE_TEST_SUITE_P(Parts, EndedBySignal,
                         testing::Values(std::pair(SIGTERM, 143), std::pair(SIGINT, 130),
                                         std::pair(SIGHUP, 129)));

}  // namespace
}  // namespace mray::test
