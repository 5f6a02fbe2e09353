// morphray merge: what it finds, and input that is not a part.
#include <png.h>

#include <cstring>

#include "common/image/frame.h"
#include "common/image/png.h"
#include "common/text/number_text.h"
#include "tests/app/farm/farm.h"

namespace mray::test {
namespace {

/// Findings of a kind as "frame/shard/host", from the JSON report of a merge.
Names findings(const TemporaryFolder& folder, const Names& folders, const std::string& kind,
               int code = 1) {
    Names arguments = folders;
    arguments.insert(arguments.end(), {"--json", "merged.json"});
    const Outcome outcome = merge(folder, arguments);
    EXPECT_EQ(outcome.code, code) << outcome.out << outcome.err;
    const Json report = read_json(folder, "merged.json");
    EXPECT_EQ(report["right"], code == 0);
    Names found;
    for (const Json& finding : report["findings"]) {
        if (finding["kind"] != kind) continue;
        found.push_back((finding["frame"].is_null() ? "-" : finding["frame"].dump()) + '/' +
                        finding["shard"].dump() + '/' + finding["host"].get<std::string>());
    }
    return found;
}

/// Changes a part in place.
template <class Change>
void change_part(const TemporaryFolder& folder, const std::string& file, Change change) {
    Json part = read_json(folder, file);
    change(part);
    folder.write(file, part.dump(1));
}

class Merge : public testing::Test {
protected:
    void SetUp() override { render_shards(folder, "out", 3, {"--verify-every", "2"}); }
    TemporaryFolder folder;
};

TEST_F(Merge, OfAllPartsFindsNothing) {
    const Outcome outcome = merge(folder, {"out", "--sheet", "sheet.png", "--json", "merged.json"});
    EXPECT_EQ(outcome.code, 0) << outcome.out << outcome.err;
    EXPECT_NE(outcome.out.find("all 8 frames are there once and whole; 8 comparisons between "
                               "shards are equal bit by bit, 0 of them on one host"),
              std::string::npos)
        << outcome.out;
    const Json report = read_json(folder, "merged.json");
    EXPECT_EQ(report["command"], "merge");
    EXPECT_EQ(report["parts"].size(), 3u);
    EXPECT_EQ(report["frames"].size(), 8u);
    EXPECT_TRUE(report["findings"].empty());
    ASSERT_EQ(run(render_of(folder, "one")).code, 0);
    EXPECT_TRUE(read_file(folder.path() / "one/sheet.png") ==
                read_file(folder.path() / "sheet.png"));
}

TEST_F(Merge, OfSeveralFoldersFindsNothing) {
    for (int i = 1; i <= 3; ++i) {
        const std::string shard = std::to_string(i);
        ASSERT_EQ(render_shard(folder, "node" + shard, shard + "/3").code, 0);
    }
    EXPECT_EQ(merge(folder, {"node1", "node2", "node3"}).code, 0);
    EXPECT_EQ(findings(folder, {"node1", "node3"}, "missing part"), Names{"-/2/"});
}

TEST_F(Merge, NamesAMissingPartAndItsFrames) {
    std::filesystem::remove(folder.path() / "out/part-2-of-3.json");
    EXPECT_EQ(findings(folder, {"out"}, "missing part"), Names{"-/2/"});
    EXPECT_EQ(findings(folder, {"out"}, "missing"), (Names{"2.0/2/", "3.0/2/", "4.0/2/"}));
}

TEST_F(Merge, NamesFramesThatFollowEachOtherInOneLine) {
    change_part(folder, "out/part-2-of-3.json", [](Json& part) { part["frames"] = Json::array(); });
    const Outcome outcome = merge(folder, {"out"});
    EXPECT_EQ(outcome.code, 1);
    EXPECT_NE(outcome.out.find("frames 2..4 of shard 2 on n2: missing: no image (3 frames)\n"),
              std::string::npos)
        << outcome.out;
}

TEST_F(Merge, ComparesWithAShardThatKnowsItsScene) {
    for (const char* state : {"failed", "interrupted", "running"}) {
        change_part(folder, "out/part-1-of-3.json", [&](Json& part) {
            part["state"] = state;
            part["scene_hash"] = "0000000000000000";
            part["triangles"] = part["vertices"] = 0;
            for (const char* list : {"all_frames", "frames", "checks", "frames_left"})
                part[list] = Json::array();
        });
        EXPECT_EQ(findings(folder, {"out"}, "differs"), Names{}) << state;
        EXPECT_EQ(findings(folder, {"out"}, "unfinished"), Names{"-/1/n1"}) << state;
        EXPECT_EQ(findings(folder, {"out"}, "missing"), (Names{"0.0/1/n1", "1.0/1/n1"})) << state;
        const Json report = read_json(folder, "merged.json");
        EXPECT_NE(report["scene_hash"], "0000000000000000");
        EXPECT_NE(merge(folder, {"out"}).out.find("6 of 8 frames"), std::string::npos);
    }
}

TEST_F(Merge, NamesAShardThatWasKilled) {
    change_part(folder, "out/part-3-of-3.json", [](Json& part) {
        part["state"] = "running";
        part["exit_code"] = nullptr;
        part["frames_left"] = Json::array({part["frames"].back()["frame"]});
        part["frames"].erase(part["frames"].size() - 1);
    });
    EXPECT_EQ(findings(folder, {"out"}, "unfinished"), Names{"-/3/n3"});
    EXPECT_EQ(findings(folder, {"out"}, "missing"), Names{"7.0/3/n3"});
}

TEST_F(Merge, NamesDamagedMissingAndExchangedImages) {
    const std::string png = read_file(folder.path() / "out/frame_0001.png");
    folder.write("out/frame_0001.png", png.substr(0, png.size() / 2));
    std::filesystem::remove(folder.path() / "out/frame_0003.png");
    folder.write("out/frame_0007.png", png);
    EXPECT_EQ(findings(folder, {"out"}, "damaged"), (Names{"1.0/1/n1", "3.0/2/n2", "7.0/3/n3"}));
    // Neither sheet nor video of what is not right.
    const Outcome outcome = merge(folder, {"out", "--sheet", "sheet.png"});
    EXPECT_EQ(outcome.code, 1);
    EXPECT_FALSE(std::filesystem::exists(folder.path() / "sheet.png"));
}

TEST_F(Merge, NamesImagesWithADamagedByteInAnyText) {
    const std::string file = "out/frame_0001.png";
    const std::string png = read_file(folder.path() / file);
    std::size_t texts = 0;
    for (std::size_t type = png.find("iTXt"); type != png.npos; type = png.find("iTXt", type + 4)) {
        ++texts;
        std::uint32_t size = 0;
        for (std::size_t i = type - 4; i < type; ++i)
            size = size << 8 | static_cast<unsigned char>(png[i]);
        // The type, the first letter of the keyword, the last letter of the text, the checksum.
        for (const std::size_t at : {type, type + 4, type + 3 + size, type + 4 + size}) {
            std::string damaged = png;
            damaged[at] ^= 1;
            folder.write(file, damaged);
            const Outcome outcome = merge(folder, {"out"});
            EXPECT_EQ(outcome.code, 1) << png.substr(type + 4, 12) << " at " << at;
            EXPECT_NE(outcome.out.find("frame 1 of shard 1 on n1: damaged: out/frame_0001.png: is "
                                       "not a PNG file that can be read ("),
                      std::string::npos)
                << outcome.out;
        }
    }
    EXPECT_EQ(texts, 5u);
    folder.write(file, png);
    EXPECT_EQ(findings(folder, {"out"}, "damaged", 0), Names{});
}

TEST_F(Merge, NamesDuplicateFramesAndShards) {
    change_part(folder, "out/part-2-of-3.json", [&](Json& part) {
        part["frames"].push_back(read_json(folder, "out/part-1-of-3.json")["frames"][0]);
    });
    EXPECT_EQ(findings(folder, {"out"}, "duplicate"), Names{"0.0/2/n1"});
    EXPECT_EQ(read_json(folder, "merged.json")["frames"].size(), 7u);
    ASSERT_EQ(render_shard(folder, "again", "3/3", {"--verify-every", "2"}, "n9").code, 0);
    EXPECT_EQ(findings(folder, {"out", "again"}, "duplicate"),
              (Names{"-/3/n9", "0.0/2/n1", "5.0/3/n9", "6.0/3/n9", "7.0/3/n9"}));
    EXPECT_NE(merge(folder, {"out", "again"}).out.find("4 of 8 frames are there once and whole"),
              std::string::npos);
}

TEST_F(Merge, NamesPartsOfAnotherVersionSceneOrCommand) {
    const auto differs = [&](auto change) {
        const std::string before = read_file(folder.path() / "out/part-3-of-3.json");
        change_part(folder, "out/part-3-of-3.json", change);
        const Names found = findings(folder, {"out"}, "differs");
        folder.write("out/part-3-of-3.json", before);
        return found;
    };
    const Names third = {"-/3/n3"};
    EXPECT_EQ(differs([](Json& part) { part["scene_hash"] = "0123456789abcdef"; }), third);
    EXPECT_EQ(differs([](Json& part) { part["source"] = "morphray render other.obj"; }), third);
    EXPECT_EQ(differs([](Json& part) { part["verify_every"] = 3; }), third);
    EXPECT_EQ(differs([](Json& part) { part["all_frames"].push_back(9); }), third);
    EXPECT_EQ(differs([](Json& part) { part["parts"] = 4; }), third);
    EXPECT_EQ(differs([](Json& part) { part["software"] = "morphray 0.0.1 (abc)"; }), third);
    EXPECT_EQ(differs([](Json& part) { part["triangles"] = 1; }), third);
    EXPECT_EQ(findings(folder, {"out"}, "differs", 0), Names{});
}

TEST_F(Merge, NamesChecksThatAreMissing) {
    change_part(folder, "out/part-1-of-3.json", [](Json& part) { part["checks"] = Json::array(); });
    EXPECT_EQ(findings(folder, {"out"}, "unverified"), (Names{"2.0/1/n1", "4.0/1/n1", "6.0/1/n1"}));
}

// ---------------------------------------------------------------- faulty nodes

/// Flips a bit of an image as a faulty node would: before it is hashed and written.
void flip_bit(const TemporaryFolder& folder, const std::string& part_file, const char* list,
              std::size_t index) {
    change_part(folder, part_file, [&](Json& part) {
        Json& entry = part[list][index];
        const std::string name = "out/" + entry["file"].get<std::string>();
        // The pixels by libpng, the texts from the file as they are.
        png_image png = {};
        png.version = PNG_IMAGE_VERSION;
        const std::string bytes = read_file(folder.path() / name);
        ASSERT_NE(png_image_begin_read_from_memory(&png, bytes.data(), bytes.size()), 0);
        png.format = PNG_FORMAT_RGBA;
        Image image{png.width, png.height, {}};
        image.pixels.resize(std::size_t{png.width} * png.height);
        ASSERT_NE(png_image_finish_read(&png, nullptr, image.pixels.data(), 0, nullptr), 0);
        image.pixels[37] ^= 1;
        const std::string hash = hash_text(image_hash(image.pixels));
        std::vector<PngText> texts;
        for (std::size_t at = 33; bytes.compare(at + 4, 4, "iTXt") == 0;) {
            std::uint32_t size = 0;
            for (std::size_t i = 0; i < 4; ++i)
                size = size << 8 | static_cast<unsigned char>(bytes[at + i]);
            const std::string chunk = bytes.substr(at + 8, size);
            const std::string keyword = chunk.c_str();
            texts.push_back(
                {keyword, keyword == "Image hash" ? hash : chunk.substr(keyword.size() + 5)});
            at += 12 + size;
        }
        const std::vector<std::byte> file = encode_png(image, texts);
        folder.write(name, std::string(reinterpret_cast<const char*>(file.data()), file.size()));
        entry["image_hash"] = hash;
    });
}

TEST_F(Merge, NamesTheFaultyNodeOfThree) {
    // Shard 2 has frames 2, 3 and 4, of which 1 and 3 check 2 and 4.
    flip_bit(folder, "out/part-2-of-3.json", "frames", 2);
    EXPECT_EQ(findings(folder, {"out"}, "disagreement"), Names{"4.0/2/n2"});
    const Json report = read_json(folder, "merged.json");
    ASSERT_EQ(report["suspects"].size(), 1u);
    EXPECT_EQ(report["suspects"][0]["host"], "n2");
    EXPECT_EQ(report["suspects"][0]["outvoted"], 1);
    const Outcome outcome = merge(folder, {"out"});
    EXPECT_NE(outcome.out.find("faulty: shard 2 on n2, alone with its images of 1 frame"),
              std::string::npos)
        << outcome.out;
}

TEST_F(Merge, NamesAFaultyNodeWhoseChecksAreWrong) {
    flip_bit(folder, "out/part-1-of-3.json", "checks", 0);
    EXPECT_EQ(findings(folder, {"out"}, "disagreement"), (Names{"2.0/1/n1"}));
}

TEST_F(Merge, NamesBothOfTwoThatDiffer) {
    std::filesystem::remove_all(folder.path() / "out");
    render_shards(folder, "out", 2, {"--verify-every", "2"});
    flip_bit(folder, "out/part-1-of-2.json", "frames", 2);
    EXPECT_EQ(findings(folder, {"out"}, "disagreement"), (Names{"2.0/1/n1", "2.0/2/n2"}));
    const Json report = read_json(folder, "merged.json");
    ASSERT_EQ(report["suspects"].size(), 2u);
    EXPECT_EQ(report["suspects"][0]["undecided"], 1);
}

#ifdef MORPHRAY_HAS_VULKAN
TEST(MergeOfMixedFarms, FindsNothing) {
    const TemporaryFolder folder;
    for (const auto& [shard, backend] :
         {std::pair("1/3", "cpu"), std::pair("2/3", "vulkan"), std::pair("3/3", "brute")}) {
        const Outcome outcome =
            render_shard(folder, "out", shard, {"--verify-every", "2", "--backend", backend});
        ASSERT_EQ(outcome.code, 0) << outcome.err;
    }
    const Outcome merged = merge(folder, {"out"});
    EXPECT_EQ(merged.code, 0) << merged.out;
    EXPECT_NE(merged.out.find("vulkan"), std::string::npos);
}
#endif

// ---------------------------------------------------------------- videos

TEST_F(Merge, FeedsAllImagesToFfmpegWithoutAShell) {
    // It shows what it is given: its input, and its arguments but the last.
    const std::filesystem::path ffmpeg = folder.write(
        "bin/ffmpeg",
        "#!/bin/sh\nfor last; do :; done\n{ cat; printf '%s\\n' \"$@\"; } >\"${last#file:}\"\n");
    std::filesystem::permissions(ffmpeg, std::filesystem::perms::owner_all);
    const std::string path = "PATH=" + folder.file("bin") + ":/usr/bin:/bin";
    const std::string name = "a $(touch planted) ';\".mp4";
    const Outcome outcome = run({"merge", "out", "--video", name, "--rate", "12"},
                                {.environment = {path}, .folder = folder.path()});
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    std::string expected;
    for (int frame = 0; frame < 8; ++frame)
        expected += read_file(folder.path() / ("out/frame_000" + std::to_string(frame) + ".png"));
    const std::string video = read_file(folder.path() / name);
    EXPECT_TRUE(video.starts_with(expected));
    EXPECT_NE(video.find("-framerate\n12\n"), std::string::npos);
    EXPECT_FALSE(std::filesystem::exists(folder.path() / "planted"));
}

TEST_F(Merge, SaysThatFfmpegIsMissing) {
    const Outcome outcome =
        run({"merge", "out", "--video", "clip.mp4"},
            {.environment = {"PATH=" + folder.file("none")}, .folder = folder.path()});
    EXPECT_EQ(outcome.code, 4);
    EXPECT_NE(outcome.err.find("ffmpeg"), std::string::npos) << outcome.err;
    EXPECT_EQ(lines(outcome.err).size(), 1u);
}

TEST_F(Merge, SaysThatFfmpegFailedAndLeavesNoFile) {
    const std::filesystem::path ffmpeg = folder.write(
        "bin/ffmpeg", "#!/bin/sh\nfor last; do :; done\necho x >\"${last#file:}\"\nexit 3\n");
    std::filesystem::permissions(ffmpeg, std::filesystem::perms::owner_all);
    const Outcome outcome = run({"merge", "out", "--video", "clip.mp4"},
                                {.environment = {"PATH=" + folder.file("bin") + ":/usr/bin:/bin"},
                                 .folder = folder.path()});
    EXPECT_EQ(outcome.code, 5);
    EXPECT_NE(outcome.err.find("exit status 3"), std::string::npos) << outcome.err;
    for (const std::string& name : folder.names()) EXPECT_FALSE(name.ends_with(".mp4")) << name;
}

// ---------------------------------------------------------------- hostile input

struct BadPart {
    const char* name;
    std::string text;
    /// A part of the message.
    const char* message;
};

/// A part with one member replaced.
std::string with(const char* member, const Json& value) {
    Json part = Json::parse(R"({"schema":"morphray/1","command":"render","version":"0.1.0","part":1,
        "parts":1,"software":"s","source":"c","scene":"x","triangles":1,"vertices":3,"width":8,
        "height":8,"scene_hash":"0123456789abcdef","verify_every":0,"all_frames":[0],
        "state":"done","exit_code":0,"reason":"","host":"h","backend":"cpu","device":"",
        "frames":[],"checks":[],"frames_left":[0],"checks_left":[]})");
    part[member] = value;
    return part.dump();
}

Json image_with(const char* member, const Json& value) {
    Json image = Json::parse(R"({"frame":0,"file":"frame_0000.png",
        "scene_hash":"0123456789abcdef","hits_hash":"0123456789abcdef",
        "image_hash":"0123456789abcdef","outputs":[],"kept":false,"host":"h","backend":"cpu",
        "device":"","total_ms":1})");
    image[member] = value;
    return Json::array({image});
}

std::string repeated(const char* text, int times) {
    std::string all;
    for (int i = 0; i < times; ++i) all += text;
    return all;
}

std::vector<BadPart> bad_parts() {
    return {
        {"empty", "", "is not JSON"},
        {"torn", with("state", "done").substr(0, 200), "is not JSON"},
        {"binary", std::string("\x89PNG\r\n\0\0\0", 9), "is not JSON"},
        {"not an object", "[1]", "is not an object"},
        {"another schema", with("schema", "other/1"), "schema"},
        {"deep", repeated("[", 1'000'000), "nested too deeply"},
        {"deep in a frame", with("frames", Json::parse(repeated("[", 9) + repeated("]", 9))),
         "nested too deeply"},
        {"many values", repeated("[", 1) + repeated("0,", 2'100'000) + "0]", "two million values"},
        {"long text", with("host", std::string(70'000, 'x')), "64 KiB"},
        {"huge number", "{\"part\": 1e999}", "cannot be read"},
        {"wrong type of a part", with("part", "1"), "part is not a whole number"},
        {"negative", with("parts", -1), "parts is not a whole number"},
        {"fraction", with("part", 0.5), "part is not a whole number"},
        {"part zero", with("part", 0), "part is not from 1 to 1"},
        {"part above parts", with("part", 2), "part is not from 1 to 1"},
        {"too many parts", with("parts", 70'000), "parts is not from"},
        {"width of 2^32", with("width", 4294967296), "width is not from"},
        {"hash of letters", with("scene_hash", "0123456789abcdeg"), "hash of 16 digits"},
        {"short hash", with("scene_hash", "12"), "hash of 16 digits"},
        {"unknown state", with("state", "sleeping"), "unknown name"},
        {"exit code", with("exit_code", 900), "exit_code is not from"},
        {"frames are no list", with("frames", Json::object()), "frames is not a list"},
        {"a frame is no object", with("frames", Json::array({1})), "lacks the member frame"},
        {"a frame that is null", with("frames", image_with("frame", nullptr)),
         "frame is not a number"},
        {"file above", with("frames", image_with("file", "../../etc/passwd")), "not in the folder"},
        {"file from the root", with("frames", image_with("file", "/etc/passwd")),
         "not in the folder"},
        {"file without a name", with("frames", image_with("file", "")), "not in the folder"},
        {"file with a NUL", with("checks", image_with("file", std::string("a\0b", 3))),
         "not in the folder"},
        {"outputs", with("frames", image_with("outputs", 3)), "outputs is not a list"},
        {"kept", with("frames", image_with("kept", 1)), "kept is neither"},
        {"frames out of order", with("all_frames", {1, 0}), "not in order"},
        {"frames twice", with("all_frames", {1, 1}), "not in order"},
    };
}

TEST(MergeOfBadParts, EndsWith3AndOneLine) {
    for (const BadPart& bad : bad_parts()) {
        const TemporaryFolder folder;
        folder.write("out/part-1-of-1.json", bad.text);
        const Outcome outcome = merge(folder, {"out"});
        EXPECT_EQ(outcome.code, 3) << bad.name;
        EXPECT_EQ(lines(outcome.err).size(), 1u) << bad.name << ": " << outcome.err;
        EXPECT_TRUE(outcome.err.starts_with("out/part-1-of-1.json:")) << outcome.err;
        EXPECT_NE(outcome.err.find(bad.message), std::string::npos)
            << bad.name << ": " << outcome.err;
    }
}

TEST(MergeOfBadParts, EachMemberIsNeeded) {
    const Json whole = Json::parse(with("frames", image_with("kept", true)));
    for (const auto& [key, value] : whole.items()) {
        if (key == "command" || key == "version") continue;
        const TemporaryFolder folder;
        Json part = whole;
        part.erase(key);
        folder.write("out/part-1-of-1.json", part.dump());
        const Outcome outcome = merge(folder, {"out"});
        EXPECT_EQ(outcome.code, 3) << key;
        EXPECT_NE(outcome.err.find("lacks the member " + key), std::string::npos) << outcome.err;
    }
}

TEST(MergeOfBadParts, FolderWithoutPartsEndsWith3) {
    const TemporaryFolder folder;
    folder.write("empty/frame_0000.png", "x");
    folder.write("file", "x");
    for (const char* name : {"empty", "file", "none"}) {
        const Outcome outcome = merge(folder, {name});
        EXPECT_EQ(outcome.code, 3) << name;
        EXPECT_EQ(lines(outcome.err).size(), 1u) << outcome.err;
    }
}

TEST(MergeOfBadParts, FilesThatAreNoRegularOnesAreFindings) {
    const TemporaryFolder folder;
    folder.write("out/part-1-of-1.json", with("frames", image_with("file", "pipe.png")));
    ASSERT_EQ(mkfifo(folder.file("out/pipe.png").c_str(), 0600), 0);
    EXPECT_EQ(findings(folder, {"out"}, "damaged"), Names{"0.0/1/h"});
    folder.write(
        "out/part-1-of-1.json",
        with("frames", image_with("outputs", Json::array({{{"file", "../../dev/zero"},
                                                           {"hash", "0123456789abcdef"}}}))));
    EXPECT_EQ(findings(folder, {"out"}, "damaged"), Names{"0.0/1/h"});
}

}  // namespace
}  // namespace mray::test
