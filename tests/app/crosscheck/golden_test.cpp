// Images whose hashes were found good once.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/app/program.h"
#include "tests/app/scenes.h"

namespace mray::test {
namespace {

using Json = nlohmann::json;
using Words = std::vector<std::string>;

Words check(const TemporaryFolder& folder, const Words& scenes, const Words& more) {
    Words words = {"crosscheck", "--backend", "cpu",   "--simd",          "off", "--size", "16x16",
                   "--frames",   "0",         "--out", folder.file("out")};
    words.insert(words.end(), scenes.begin(), scenes.end());
    words.insert(words.end(), more.begin(), more.end());
    return words;
}

/// The hashes of the cloth's first frame.
std::string bless_cloth(const TemporaryFolder& folder) {
    const std::string file = folder.file("golden.json");
    const Outcome outcome = run(check(folder, {"builtin:cloth:200"}, {"--bless", file, "-q"}));
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    return file;
}

/// Compares every built-in scene with the committed hashes.
void expect_golden_images(const Words& backend) {
    const TemporaryFolder folder;
    const Json golden = Json::parse(read_file(GOLDEN_FILE));
    Words words = {"crosscheck", "--reference", "brute",           "--size",
                   "64x64",      "--frames",    "0..12:12",        "--ao-samples",
                   "4",          "--expect",    GOLDEN_FILE,       "--json",
                   "-",          "--out",       folder.file("out")};
    words.insert(words.end(), backend.begin(), backend.end());
    for (const Json& scene : golden["scenes"]) words.push_back(scene["scene"]);
    const Outcome outcome = run(words);
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    const Json json = Json::parse(outcome.out);
    EXPECT_EQ(json["scenes"].size(), golden["scenes"].size());
    for (const Json& scene : json["scenes"]) {
        EXPECT_EQ(scene["expected"].size(), 6u);
        for (const Json& image : scene["expected"])
            EXPECT_EQ(image["problem"], "") << scene["scene"] << image;
    }
}

TEST(ExpectedImages, HaveEveryBuiltInScene) {
    const Json golden = Json::parse(read_file(GOLDEN_FILE));
    Words scenes, builtins;
    for (const Json& scene : golden["scenes"]) {
        scenes.push_back(scene["scene"]);
        EXPECT_EQ(scene["images"].size(), 6u) << scenes.back();
    }
    const Json info = Json::parse(run({"info", "--json", "-"}).out);
    for (const Json& scene : info["builtins"])
        builtins.push_back("builtin:" + scene["name"].get<std::string>() + ":200");
    EXPECT_EQ(scenes, builtins) << "tests/app/crosscheck/bless writes them again";
}

TEST(ExpectedImages, AreThoseOfTheCpu) { expect_golden_images({"--backend", "cpu"}); }

#ifdef MORPHRAY_HAS_VULKAN
TEST(ExpectedImages, AreThoseOfVulkan) { expect_golden_images({"--backend", "vulkan"}); }
#endif

TEST(ExpectedImages, AreFoundEqual) {
    const TemporaryFolder folder;
    const std::string file = bless_cloth(folder);
    const Json golden = Json::parse(read_file(file));
    EXPECT_EQ(golden["command"], "crosscheck --bless");
    EXPECT_TRUE(golden["environment"].contains("simd"));
    const Json& image = golden["scenes"][0]["images"][0];
    EXPECT_EQ(image["hits_hash"].get<std::string>().size(), 16u);
    EXPECT_GT(image["hits"], 0);
    const Outcome outcome = run(check(folder, {"builtin:cloth:200"}, {"--expect", file}));
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    EXPECT_NE(outcome.out.find("expected images, 3: equal\n"), std::string::npos) << outcome.out;
}

TEST(ExpectedImages, AreFoundByTheirSecond) {
    const TemporaryFolder folder;
    const std::string file = bless_cloth(folder);
    const Outcome outcome =
        run({"crosscheck", "builtin:cloth:200", "--backend", "cpu", "--simd", "off", "--size",
             "16x16", "--time", "0", "--fps", "12", "--expect", file, "--out", folder.file("out")});
    EXPECT_EQ(outcome.code, 0) << outcome.out << outcome.err;
}

TEST(ExpectedImages, ThatDifferAreNamed) {
    const TemporaryFolder folder;
    const std::string file = bless_cloth(folder);
    Json golden = Json::parse(read_file(file));
    Json& image = golden["scenes"][0]["images"][1];
    image["image_hash"] = "0123456789abcdef";
    image["hits"] = 1;
    const std::string changed = folder.write("changed.json", golden.dump(1));
    const std::string junit = folder.file("r.xml");
    const Outcome outcome =
        run(check(folder, {"builtin:cloth:200"}, {"--expect", changed, "--junit", junit}));
    EXPECT_EQ(outcome.code, 1) << outcome.err;
    EXPECT_NE(outcome.out.find("expected images, 3: 1 of 3 differ\n  frame 0, shadow: hits "),
              std::string::npos)
        << outcome.out;
    EXPECT_NE(outcome.out.find(" instead of 0123456789abcdef"), std::string::npos) << outcome.out;
    const std::string xml = read_file(junit);
    EXPECT_NE(xml.find("failures=\"1\""), std::string::npos) << xml;
    EXPECT_NE(xml.find("name=\"frame 0 shadow is as expected\""), std::string::npos) << xml;
}

TEST(ExpectedImages, ThatTheFileLacksAreFailures) {
    const TemporaryFolder folder;
    const std::string file = bless_cloth(folder);
    const auto expect_problem = [&](const Words& scenes, const Words& more, const char* text) {
        Words words = check(folder, scenes, more);
        words.insert(words.end(), {"--expect", file});
        const Outcome outcome = run(words);
        EXPECT_EQ(outcome.code, 1) << outcome.err;
        EXPECT_NE(outcome.out.find(text), std::string::npos) << outcome.out;
    };
    expect_problem({"builtin:twist:200"}, {}, "has no image of builtin:twist:200 of 16x16");
    expect_problem({"builtin:cloth:200"}, {"--ao-samples", "2"}, "with --ao-samples 2");
    // The same image, whatever the tree.
    EXPECT_EQ(
        run(check(folder, {"builtin:cloth:200"}, {"--expect", file, "--build", "sweep"})).code, 0);
}

TEST(ExpectedImages, AreReadFromAFileOfBlessAlone) {
    const TemporaryFolder folder;
    const auto expect_refused = [&](const std::string& file, const std::string& text) {
        const Outcome outcome = run(check(folder, {"builtin:cloth:200"}, {"--expect", file}));
        EXPECT_EQ(outcome.code, 3) << outcome.err;
        EXPECT_TRUE(outcome.err.starts_with(file)) << outcome.err;
        EXPECT_NE(outcome.err.find(text), std::string::npos) << outcome.err;
        EXPECT_EQ(outcome.out, "");
    };
    expect_refused(folder.file("none"), "no such file");
    expect_refused(folder.write("text", "{\n\"a\": 1,\n b").native(), "text:3: is not JSON");
    expect_refused(folder.write("other", "{\"command\": \"render\"}").native(),
                   "is another report");
    expect_refused(folder.write("list", "[]").native(), "lacks a member");
    Json golden = Json::parse(read_file(bless_cloth(folder)));
    golden["scenes"][0]["images"][0]["hits_hash"] = "12";
    expect_refused(folder.write("hash", golden.dump()).native(), "16 hexadecimal digits");
    golden["scenes"][0]["images"] = nullptr;
    expect_refused(folder.write("images", golden.dump()).native(), "lacks a member");
}

TEST(ExpectedImages, AreBlessedOnlyIfAllAreThereAndEqual) {
    const TemporaryFolder folder;
    folder.write("s/f_0.obj", square_at(0));
    folder.write("s/f_1.obj", "v 0 0 0\nv nan 0 0\nv 0 1 0\nv 1 1 1\nf 1 2 3\nf 1 3 4\n");
    const std::string file = folder.file("golden.json");
    const Outcome outcome =
        run({"crosscheck", folder.file("s"), "--backend", "cpu", "--simd", "off", "--size", "16x16",
             "--bless", file, "--out", folder.file("out"), "-q"});
    EXPECT_EQ(outcome.code, 8) << outcome.err;
    EXPECT_NE(outcome.err.find(file + ": not written"), std::string::npos) << outcome.err;
    EXPECT_FALSE(std::filesystem::exists(file));
    EXPECT_EQ(run(check(folder, {"builtin:cloth:200"}, {"--bless", file, "--expect", file})).code,
              2);
}

}  // namespace
}  // namespace mray::test
