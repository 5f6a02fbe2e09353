// Bundles of a ray: written by probe, traced again from the file alone.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/app/program.h"
#include "tests/app/scenes.h"

namespace mray::test {
namespace {

using Json = nlohmann::json;
using Words = std::vector<std::string>;

/// Bundles pixel 20,16 of 32x32 on the CPU.
std::string write_bundle(const TemporaryFolder& folder, const std::string& scene, Words more = {}) {
    const std::string file = folder.file("ray.json");
    Words words = {"probe",  scene, "--pixel",   "20,16", "--size",   "32x32",
                   "--json", "-",   "--backend", "cpu",   "--bundle", file};
    if (std::find(more.begin(), more.end(), "--frame") == more.end())
        more.insert(more.end(), {"--frame", "0"});
    words.insert(words.end(), more.begin(), more.end());
    const Outcome outcome = run(words);
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    return file;
}

void expect_equal_answers(const std::string& file, std::size_t least) {
    const Outcome outcome = run({"probe", file, "--backend", "cpu", "--json", "-"});
    EXPECT_EQ(outcome.code, 0) << outcome.err << outcome.out;
    const Json json = Json::parse(outcome.out);
    EXPECT_GE(json["answers"].size(), least);
    for (const Json& answer : json["answers"]) {
        EXPECT_EQ(answer["hit"], json["expected"]) << answer;
        EXPECT_EQ(answer["equal"], true);
    }
}

TEST(Bundle, OfASmallSceneHasAllOfIt) {
    const TemporaryFolder folder;
    const std::string file = write_bundle(folder, "builtin:cloth:500", {"--frame", "6.5"});
    const Json bundle = Json::parse(read_file(file));
    EXPECT_EQ(bundle["triangles"].size(), bundle["scene_triangles"]);
    EXPECT_EQ(bundle["frame"], 6.5);
    EXPECT_FALSE(bundle["brute"].is_null());
    EXPECT_EQ(bundle["brute"], bundle["in_image"]);
    EXPECT_EQ(bundle["brute"], bundle["alone"]);
    // Brute force alone; without SIMD and each instruction set alone and in the image.
    expect_equal_answers(file, 1 + 2 * 2);
    const Outcome one = run({"probe", file, "--backend", "cpu", "--simd", "off"});
    EXPECT_EQ(one.code, 0) << one.err;
    EXPECT_NE(one.out.find("cpu, in the image "), std::string::npos) << one.out;
    EXPECT_EQ(one.out.find("cpu scalar"), std::string::npos) << one.out;
}

TEST(Bundle, OfALargeSceneHasTheTrianglesAlongTheRay) {
    const TemporaryFolder folder;
    const std::string file = write_bundle(folder, "builtin:cloth:20000", {"--frame", "12"});
    const Json bundle = Json::parse(read_file(file));
    EXPECT_GT(bundle["scene_triangles"], 10000);
    EXPECT_LT(bundle["triangles"].size(), 200u);
    EXPECT_EQ(bundle["prim_ids"].size(), bundle["triangles"].size());
    const auto& ids = bundle["prim_ids"];
    EXPECT_NE(std::find(ids.begin(), ids.end(), bundle["brute"]["prim_id"]), ids.end());
    expect_equal_answers(file, 5);
}

TEST(Bundle, OfAMissIsAMiss) {
    const TemporaryFolder folder;
    const std::string scene = folder.write("s.obj", square_at(0));
    const std::string file = write_bundle(folder, scene, {"--eye", "0,0,90", "--target", "0,0,0"});
    EXPECT_TRUE(Json::parse(read_file(file))["brute"].is_null());
    expect_equal_answers(file, 5);
}

TEST(Bundle, OfVerticesThatAreNotFiniteIsRead) {
    const TemporaryFolder folder;
    const std::string scene = folder.write("s.obj", square_at(0) + "v nan 0 0\nf 1 2 5\n");
    expect_equal_answers(write_bundle(folder, scene, {"--lenient"}), 5);
}

TEST(Bundle, AnotherAnswerThanTheRecordedOneFails) {
    const TemporaryFolder folder;
    Json bundle =
        Json::parse(read_file(write_bundle(folder, "builtin:cloth:500", {"--frame", "6.5"})));
    bundle["brute"]["prim_id"] = bundle["brute"]["prim_id"].get<int>() + 1;
    const Outcome outcome =
        run({"probe", folder.write("other.json", bundle.dump()), "--backend", "cpu"});
    EXPECT_EQ(outcome.code, 1) << outcome.err;
    EXPECT_NE(outcome.out.find("differs"), std::string::npos) << outcome.out;
}

TEST(Bundle, ThatIsDamagedIsRefused) {
    const TemporaryFolder folder;
    const Json good = Json::parse(read_file(write_bundle(folder, "builtin:cloth:500")));
    const auto expect_refused = [&](const std::string& text, const std::string& reason) {
        const std::string file = folder.write("bad.json", text).native();
        const Outcome outcome = run({"probe", file, "--backend", "cpu"});
        EXPECT_EQ(outcome.code, 3) << outcome.err;
        EXPECT_TRUE(outcome.err.starts_with(file)) << outcome.err;
        EXPECT_NE(outcome.err.find(reason), std::string::npos) << outcome.err;
        EXPECT_EQ(outcome.out, "");
    };
    const auto with = [&](const char* member, const Json& value) {
        Json bad = good;
        bad[Json::json_pointer(member)] = value;
        return bad.dump();
    };
    expect_refused("{\n\n3", "bad.json:3: is not JSON");
    expect_refused("[]", "lacks a member");
    expect_refused(with("/command", "render"), "another report");
    expect_refused(with("/positions/0/0", 0.1), "not exact");
    expect_refused(with("/positions/0/0", 1e300), "not exact");
    expect_refused(with("/positions/0/0", 4194304.0), "not one of scene space");
    expect_refused(with("/triangles/0/1", 1000000), "not there");
    expect_refused(with("/triangles/0/1", -1), "out of range");
    expect_refused(with("/prim_ids/1", 0), "do not ascend");
    expect_refused(with("/pixel/0", 32), "not in the image");
    expect_refused(with("/pixel/0", 3), "not that of the pixel");
    expect_refused(with("/image/width", 4000000000u), "too large");
    Json fewer = good;
    fewer["prim_ids"].erase(fewer["prim_ids"].size() - 1);
    expect_refused(fewer.dump(), "not every triangle");
}

TEST(Bundle, HasItsOwnFrameAndPixel) {
    const TemporaryFolder folder;
    const std::string file = write_bundle(folder, "builtin:cloth:500");
    const auto expect_usage = [](const Words& words, const std::string& text) {
        const Outcome outcome = run(words);
        EXPECT_EQ(outcome.code, 2) << outcome.err;
        EXPECT_NE(outcome.err.find(text), std::string::npos) << outcome.err;
    };
    expect_usage({"probe", file, "--frame", "0"}, "is a bundle, which has its own");
    expect_usage({"probe", file, "--pixel", "0,0"}, "is a bundle, which has its own");
    expect_usage({"probe", file, "--bundle", folder.file("b.json")}, "is a bundle already");
    expect_usage({"probe", "builtin:cloth:500", "--frame", "0"}, "--pixel is required");
    expect_usage({"probe", "builtin:cloth:500", "--pixel", "0,0"}, "--frame is required");
    expect_usage({"probe", "builtin:cloth:500", "--pixel", "0,0", "--frame", "0", "--bundle",
                  folder.file("ray.txt")},
                 "must end in .json");
}

}  // namespace
}  // namespace mray::test
