// Files of scenes on the command line: every command decides alike about one, and the options of
// glTF files.
#include <gtest/gtest.h>

#include <string>
#include <utility>
#include <vector>

#include "tests/app/program.h"
#include "tests/app/scenes.h"
#include "tests/scenes/gltf/gltf_builder.h"
#include "tests/scenes/ply/ply_files.h"

namespace mray::test {
namespace {

/// How each command is told to read a scene, whose name goes behind the first word.
const std::vector<Words> kCommands = {
    {"info"},
    {"trace", "--rays", "-", "--out", "-"},
    {"query", "--points", "-", "--ask", "closest"},
    {"probe", "--frame", "0", "--pixel", "1,1", "--backend", "cpu"},
    {"render", "--backend", "cpu", "--size", "8x8", "--samples", "1", "--frames", "0"},
    {"profile", "--backend", "cpu", "--size", "8x8", "--frames", "0", "--repeat", "1"},
    {"crosscheck", "--backend", "cpu", "--size", "8x8", "--frames", "0"},
};

Outcome run_on(Words command, const std::string& scene, const TemporaryFolder& folder,
               const Words& more = {}) {
    if (command[0] == "render") command.insert(command.end(), {"--out", folder.file("out")});
    command.insert(command.begin() + 1, scene);
    command.insert(command.end(), more.begin(), more.end());
    return run(command,
               {.input = "0.2 0.2 -1" + std::string(command[0] == "query" ? "" : " 0 0 1") + "\n"});
}

struct Case {
    std::string file;
    std::string bytes;
    /// The exit codes of every command, without --lenient and with it.
    int strict;
    int lenient;
};

std::vector<Case> cases() {
    const std::string vertices = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
    const std::vector<std::vector<double>> corners = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    const std::string text =
        ply(PlyEncoding::kText, {ply_vertices(corners), ply_faces({{3, 0, 1, 2}})});
    const std::string binary =
        ply(PlyEncoding::kBigEndian, {ply_vertices(corners), ply_faces({{3, 0, 1, 2}})});
    PlyItems coloured = ply_vertices({{0, 0, 0, 300}, {1, 0, 0, 300}, {0, 1, 0, 300}});
    coloured.properties.insert(coloured.properties.end(), {"int red"});
    for (const char* name : {"int green", "int blue"}) {
        coloured.properties.emplace_back(name);
        for (auto& item : coloured.items) item.push_back(-1);
    }
    GltfBuilder equal_times = triangle_file();
    equal_times.add_animation(0, "translation", {0, 1, 1},
                              equal_times.add_accessor<float>({0, 0, 0, 1, 0, 0, 2, 0, 0}, "VEC3"));
    GltfBuilder no_material = triangle_file();
    no_material.json["meshes"][0]["primitives"][0]["material"] = 5;
    const std::string glb = triangle_file().glb();
    return {
        {"whole.obj", vertices + "f 1 2 3\n", 0, 0},
        {"no_v4.obj", vertices + "f 1 2 3\nf 1 2 4\n", 3, 0},
        {"bad_face.obj", vertices + "f 1 2 3\nf 1 2 3x\n", 3, 0},
        {"cut_face.obj", vertices + "f 1 2 3\nf 1 2", 3, 0},
        {"not_finite.obj", vertices + "v 0 0 nan\nf 1 2 3\nf 1 2 4\n", 3, 0},
        {"beyond.obj", vertices + "v 0 0 2e30\nf 1 2 3\nf 1 2 4\n", 3, 0},
        {"comma.obj", vertices + "v 0,5 0 0\nf 1 2 3\n", 3, 3},
        {"no_faces.obj", vertices, 3, 3},
        {"cut.ply", text.substr(0, text.size() - 4), 3, 3},
        {"cut_face.ply", binary.substr(0, binary.size() - 2), 3, 3},
        {"index.ply",
         ply(PlyEncoding::kText, {ply_vertices(corners), ply_faces({{3, 0, 1, 2}, {3, 0, 1, 3}})}),
         3, 0},
        {"colour.ply", ply(PlyEncoding::kText, {coloured, ply_faces({{3, 0, 1, 2}})}), 0, 0},
        {"colour.obj", "mtllib none.mtl\nusemtl a\nv 0 0 0 9 9 9\nv 1 0 0 1 1\nv 0 1 0\nf 1 2 3\n",
         0, 0},
        {"equal_times.glb", equal_times.glb(), 3, 3},
        {"no_material.glb", no_material.glb(), 0, 0},
        {"cut.glb", glb.substr(0, glb.size() - 4), 3, 3},
    };
}

TEST(MalformedFiles, EveryCommandDecidesAlike) {
    const TemporaryFolder folder;
    for (const Case& one : cases()) {
        const std::string scene = folder.write(one.file, one.bytes);
        std::string message;
        for (const Words& command : kCommands) {
            SCOPED_TRACE(command[0] + ' ' + one.file);
            const Outcome strict = run_on(command, scene, folder);
            EXPECT_EQ(strict.code, one.strict) << strict.err;
            EXPECT_EQ(run_on(command, scene, folder, {"--lenient"}).code, one.lenient);
            if (one.strict == 0) continue;
            if (message.empty()) message = lines(strict.err).at(0);
            EXPECT_EQ(lines(strict.err).at(0), message);
        }
    }
}

TEST(MalformedFiles, ADamagedTextureRefusesLitImagesAlone) {
    const TemporaryFolder folder;
    folder.write("a.png", "\x89PNG\r\n\x1a\n");
    folder.write("a.mtl", "newmtl a\nmap_Kd a.png\n");
    const std::string scene = folder.write(
        "a.obj", "mtllib a.mtl\nusemtl a\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nf 1/1 2/1 3/1\n");
    for (const Words& command : kCommands)
        EXPECT_EQ(run_on(command, scene, folder).code, command[0] == "render" ? 3 : 0)
            << command[0];
    EXPECT_EQ(run_on(kCommands[4], scene, folder, {"--shading", "plain"}).code, 0);
    EXPECT_EQ(run_on(kCommands[4], scene, folder, {"--lenient"}).code, 0);
}

/// A triangle that moves 24 to the right in two seconds, and one that stays.
GltfBuilder moving_gltf() {
    GltfBuilder builder = triangle_file();
    builder.add_animation(0, "translation", {0, 2},
                          builder.add_accessor<float>({0, 0, 0, 24, 0, 0}, "VEC3"));
    builder.json["animations"][0]["name"] = "slide";
    return builder;
}

Outcome render(const std::string& scene, const TemporaryFolder& folder, Words more) {
    more.insert(more.begin(), {"render", scene, "--backend", "cpu", "--size", "8x8", "--samples",
                               "1", "--out", folder.file("out")});
    return run(more);
}

/// The answer to a ray down onto (x + 0.25, 0.25).
std::string trace(const std::string& scene, int x, Words more) {
    more.insert(more.begin(), {"trace", scene, "--rays", "-", "--out", "-"});
    return run(more, {.input = std::to_string(x) + ".25 0.25 1 0 0 -1\n"}).out;
}

TEST(GltfProgram, FramesAreSecondsTimesFps) {
    const TemporaryFolder folder;
    const std::string scene = folder.write("a.glb", moving_gltf().glb());
    const std::string hit = "H 1 0 0.25 0.25\n";
    EXPECT_EQ(trace(scene, 0, {}), hit);
    EXPECT_EQ(trace(scene, 6, {"--frame", "12"}), hit);
    EXPECT_EQ(trace(scene, 6, {"--frame", "5", "--fps", "10"}), hit);
    EXPECT_EQ(trace(scene, 6, {"--frame", "5", "--fps", "10", "--animation", "slide"}), hit);
    EXPECT_EQ(trace(scene, 24, {"--frame", "24"}), "M\n");
}

TEST(GltfProgram, InfoShowsTheTime) {
    const TemporaryFolder folder;
    const std::string scene = folder.write("a.glb", moving_gltf().glb());
    EXPECT_TRUE(has(run({"info", scene}).out, "frames          0 to 48 (2 s, 24 a second)\n"));
    EXPECT_EQ(Json::parse(run({"info", scene, "--json", "-", "--fps", "30"}).out)["fps"], 30);
}

TEST(GltfProgram, InfoListsTheAnimations) {
    const TemporaryFolder folder;
    GltfBuilder builder = moving_gltf();
    builder.add_animation(0, "scale", {0, 0.5f},
                          builder.add_accessor<float>({1, 1, 1, 2, 2, 2}, "VEC3"));
    const std::string scene = folder.write("a.glb", builder.glb());
    EXPECT_TRUE(has(run({"info", scene}).out,
                    "animation       0 'slide', shown\n"
                    "animation       1\n"));
    const Outcome chosen = run({"info", scene, "--animation", "1", "--json", "-"});
    EXPECT_EQ(chosen.err, "");
    const Json expected = {{{"index", 0}, {"name", "slide"}, {"shown", false}},
                           {{"index", 1}, {"name", ""}, {"shown", true}}};
    EXPECT_EQ(Json::parse(chosen.out)["animations"], expected);
    EXPECT_EQ(Json::parse(run({"info", "builtin:cloth:500", "--json", "-"}).out)["animations"],
              Json::array());
}

TEST(GltfProgram, AnUnknownAnimationIsAUsageError) {
    const TemporaryFolder folder;
    const Outcome outcome =
        run({"info", folder.write("b.glb", moving_gltf().glb()), "--animation", "x"});
    EXPECT_EQ(outcome.code, 2);
    EXPECT_TRUE(has(outcome.err, "choose one of 0 'slide'"));
}

TEST(GltfProgram, TheCommandInAnImageRendersItAgain) {
    const TemporaryFolder folder;
    const std::string scene = folder.write("a.glb", moving_gltf().glb());
    EXPECT_EQ(
        render(scene, folder, {"--animation", "slide", "--fps", "10", "--frames", "5.5"}).code, 0);
    const std::filesystem::path image = folder.path() / "out/frame_0005.5.png";
    Words command = source_of(image);
    command.insert(command.end(), {"--out", folder.file("again")});
    const Outcome again = run(command);
    EXPECT_EQ(again.code, 0) << again.err;
    EXPECT_EQ(read_file(image), read_file(folder.path() / "again/frame_0005.5.png"));
}

}  // namespace
}  // namespace mray::test
