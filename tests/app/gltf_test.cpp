// glTF files and seconds on the command line.
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "tests/app/program.h"
#include "tests/app/scenes.h"
#include "tests/scenes/gltf/gltf_builder.h"

namespace mray::test {
namespace {

using Names = std::vector<std::string>;

/// A triangle that moves 24 to the right in two seconds, and one that stays.
std::string moving_glb() {
    GltfBuilder builder = triangle_file();
    builder.add_animation(0, "translation", {0, 2},
                          builder.add_accessor<float>({0, 0, 0, 24, 0, 0}, "VEC3"));
    builder.json["animations"][0]["name"] = "slide";
    return builder.glb();
}

Outcome render(const std::string& scene, const TemporaryFolder& folder, Names more) {
    more.insert(more.begin(), {"render", scene, "--backend", "cpu", "--size", "8x8", "--samples",
                               "1", "--out", folder.file("out")});
    return run(more);
}

/// The answer to a ray down onto (x + 0.25, 0.25).
std::string trace(const std::string& scene, int x, Names more) {
    more.insert(more.begin(), {"trace", scene, "--rays", "-", "--out", "-"});
    return run(more, {.input = std::to_string(x) + ".25 0.25 1 0 0 -1\n"}).out;
}

TEST(GltfProgram, FramesAreSecondsTimesFps) {
    const TemporaryFolder folder;
    const std::string scene = folder.write("a.glb", moving_glb());
    const std::string hit = "H 1 0 0.25 0.25\n";
    EXPECT_EQ(trace(scene, 0, {}), hit);
    EXPECT_EQ(trace(scene, 6, {"--frame", "12"}), hit);
    EXPECT_EQ(trace(scene, 6, {"--frame", "5", "--fps", "10"}), hit);
    EXPECT_EQ(trace(scene, 6, {"--frame", "5", "--fps", "10", "--animation", "slide"}), hit);
    EXPECT_EQ(trace(scene, 24, {"--frame", "24"}), "M\n");
}

TEST(GltfProgram, InfoShowsTheTime) {
    const TemporaryFolder folder;
    const std::string scene = folder.write("a.glb", moving_glb());
    EXPECT_NE(run({"info", scene}).out.find("frames          0 to 48 (2 s, 24 a second)\n"),
              std::string::npos);
    EXPECT_EQ(Json::parse(run({"info", scene, "--json", "-", "--fps", "30"}).out)["fps"], 30);
}

TEST(GltfProgram, InfoListsTheAnimations) {
    const TemporaryFolder folder;
    GltfBuilder builder = triangle_file();
    builder.add_animation(0, "translation", {0, 2},
                          builder.add_accessor<float>({0, 0, 0, 24, 0, 0}, "VEC3"));
    builder.json["animations"][0]["name"] = "slide";
    builder.add_animation(0, "scale", {0, 0.5f},
                          builder.add_accessor<float>({1, 1, 1, 2, 2, 2}, "VEC3"));
    const std::string scene = folder.write("a.glb", builder.glb());
    EXPECT_NE(run({"info", scene})
                  .out.find("animation       0 'slide', shown\n"
                            "animation       1\n"),
              std::string::npos)
        << run({"info", scene}).out;
    const Outcome chosen = run({"info", scene, "--animation", "1", "--json", "-"});
    EXPECT_EQ(chosen.err, "");
    const Json expected = {{{"index", 0}, {"name", "slide"}, {"shown", false}},
                           {{"index", 1}, {"name", ""}, {"shown", true}}};
    EXPECT_EQ(Json::parse(chosen.out)["animations"], expected);
    EXPECT_EQ(Json::parse(run({"info", "builtin:cloth:500", "--json", "-"}).out)["animations"],
              Json::array());
}

TEST(GltfProgram, BadFilesAreBadInputWithTheirPlace) {
    const TemporaryFolder folder;
    GltfBuilder builder = triangle_file();
    builder.json["accessors"][0]["count"] = 4000000000u;
    const std::string scene = folder.write("a.gltf", builder.gltf());
    const Outcome outcome = render(scene, folder, {});
    EXPECT_EQ(outcome.code, 3);
    EXPECT_EQ(lines(outcome.err).size(), 1u) << outcome.err;
    EXPECT_NE(outcome.err.find("a.gltf: accessors[0]: bytes 0 to 48000000000 are not in"),
              std::string::npos)
        << outcome.err;
    EXPECT_EQ(folder.names(), Names{"a.gltf"});
    const Outcome animation =
        run({"info", folder.write("b.glb", moving_glb()), "--animation", "x"});
    EXPECT_EQ(animation.code, 2);
    EXPECT_NE(animation.err.find("choose one of 0 'slide'"), std::string::npos) << animation.err;
}

TEST(GltfProgram, TheCommandInAnImageRendersItAgain) {
    const TemporaryFolder folder;
    const std::string scene = folder.write("a.glb", moving_glb());
    EXPECT_EQ(
        render(scene, folder, {"--animation", "slide", "--fps", "10", "--frames", "5.5"}).code, 0);
    const std::filesystem::path image = folder.path() / "out/frame_0005.5.png";
    Names command = source_of(image);
    command.insert(command.end(), {"--out", folder.file("again")});
    const Outcome again = run(command);
    EXPECT_EQ(again.code, 0) << again.err;
    EXPECT_EQ(read_file(image), read_file(folder.path() / "again/frame_0005.5.png"));
}

}  // namespace
}  // namespace mray::test
