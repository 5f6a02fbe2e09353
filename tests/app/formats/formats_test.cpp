// The formats of scenes as a user meets them.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/app/program.h"

namespace mray::test {
namespace {

using Json = nlohmann::json;

const std::string kPlyHead =
    "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\n"
    "property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n";
const std::string kPly = kPlyHead + "0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3\n";
const std::string kObj = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n";

void expect_bad_scene(const std::string& path, const std::string& message) {
    const Outcome outcome = run({"info", path});
    EXPECT_EQ(outcome.code, 3) << path;
    EXPECT_NE(outcome.err.find(message), std::string::npos) << outcome.err;
    EXPECT_EQ(lines(outcome.err).size(), 1u);
}

TEST(Formats, AreListedAsTextAndJson) {
    const Outcome text = run({"info", "--formats"});
    EXPECT_EQ(text.code, 0) << text.err;
    const Json json = Json::parse(run({"info", "--formats", "--json", "-"}).out);
    EXPECT_EQ(json["schema"], "morphray/1");
    ASSERT_GE(json["formats"].size(), 15u);
    EXPECT_EQ(json["formats"][0]["name"], "OBJ");
    EXPECT_EQ(json["formats"][1]["extensions"], Json{".ply"});
    for (const Json& format : json["formats"])
        EXPECT_NE(text.out.find(format["content"].get<std::string>()), std::string::npos);
    const Outcome both = run({"info", "--formats", "builtin:cloth"});
    EXPECT_EQ(both.code, 2);
    EXPECT_NE(both.err.find("excludes --formats"), std::string::npos) << both.err;
}

// Messages and the guide name the same formats.
TEST(Formats, AreThoseOfMessagesAndGuide) {
    const TemporaryFolder folder;
    const Json json = Json::parse(run({"info", "--formats", "--json", "-"}).out);
    const std::string error = run({"info", folder.write("a.xyz", "")}).err;
    const std::string guide = read_file(FORMATS_PAGE);
    for (const Json& format : json["formats"]) {
        if (format["use"] != "mesh") continue;
        const std::string name = format["name"];
        const std::string extension = format["extensions"][0];
        EXPECT_NE(error.find(extension), std::string::npos) << error;
        EXPECT_NE(guide.find('`' + extension + '`'), std::string::npos) << extension;
        EXPECT_NE(guide.find(name), std::string::npos) << name;
    }
    expect_bad_scene(folder.file("a.xyz"), "a.xyz: not a scene file; give an .obj or .ply");
}

TEST(Formats, PlyAndObjGiveTheSameImages) {
    const TemporaryFolder folder;
    std::string expected;
    for (const std::string scene : {folder.write("a.obj", kObj), folder.write("a.ply", kPly)}) {
        for (const char* backend : {"cpu", "brute"}) {
            const Outcome outcome = run({"render", scene, "--backend", backend, "--size", "32x32",
                                         "--out", folder.file("out"), "--json", "-"});
            ASSERT_EQ(outcome.code, 0) << outcome.err;
            const std::string hash = Json::parse(outcome.out)["frames"][0]["image_hash"];
            if (expected.empty()) expected = hash;
            EXPECT_EQ(hash, expected);
        }
    }
}

TEST(Formats, BadPlyIsBadInputAndLeavesNoImage) {
    const TemporaryFolder folder;
    const std::string path =
        folder.write("a.ply", kPlyHead + "0 0 0\n1 nan 0\n1 1 0\n0 1 0\n4 0 1 2 3\n");
    expect_bad_scene(path, "a.ply:11: coordinate 'nan' is not finite; repair it");
    const Outcome outcome = run({"render", path, "--out", folder.file("out")});
    EXPECT_EQ(outcome.code, 3);
    EXPECT_EQ(folder.names(), std::vector<std::string>{"a.ply"});
    EXPECT_EQ(run({"info", path, "--lenient"}).code, 0);
}

}  // namespace
}  // namespace mray::test
