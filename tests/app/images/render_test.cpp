// Images, frames, textures, and what is kept when a frame fails.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include <nlohmann/json.hpp>

#include "common/image/png.h"
#include "tests/app/images/image_files.h"
#include "tests/app/program.h"
#include "tests/app/scenes.h"
#include "tests/scenes/gltf/gltf_builder.h"
#include "tests/support/base64.h"

namespace mray::test {
namespace {

using Json = nlohmann::json;

Outcome render(const std::string& scene, const TemporaryFolder& folder, const Words& more = {}) {
    return run(
        words("render " + scene + " --backend cpu --size 24x24 --out " + folder.file("out"), more));
}

Json render_json(const std::string& scene, const TemporaryFolder& folder, Words more = {}) {
    more.insert(more.end(), {"--json", "-"});
    return json_of(render(scene, folder, more));
}

TEST(Render, ListsOfFramesAreTheImagesOfTheirFrames) {
    TemporaryFolder list;
    EXPECT_EQ(render("builtin:orbits:500", list, {"--frames", "0..4:2,7,20.5"}).code, 0);
    EXPECT_EQ(list.names(),
              (Words{"out", "out/frame_0000.0.png", "out/frame_0002.0.png", "out/frame_0004.0.png",
                     "out/frame_0007.0.png", "out/frame_0020.5.png"}));
    // Frame 7 has left the bounds of the first frame.
    TemporaryFolder one;
    EXPECT_EQ(render("builtin:orbits:500", one, {"--frames", "7"}).code, 0);
    EXPECT_EQ(read_file(list.path() / "out/frame_0007.0.png"),
              read_file(one.path() / "out/frame_0007.png"));
}

TEST(Render, AllWholeFramesAreTheDefault) {
    TemporaryFolder folder;
    folder.write("s/f_3.obj", square_at(0));
    folder.write("s/f_4.obj", square_at(1));
    folder.write("s/f_5.obj", square_at(2));
    TemporaryFolder out;
    const Outcome outcome = render(folder.file("s/f_%d.obj"), out);
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    EXPECT_EQ(outcome.err, "");
    EXPECT_EQ(lines(outcome.out).size(), 4u) << outcome.out;
    EXPECT_EQ(out.names(),
              (Words{"out", "out/frame_0003.png", "out/frame_0004.png", "out/frame_0005.png"}));
}

TEST(Render, JsonHasTheMembersOfTheSchema) {
    TemporaryFolder folder;
    const Json json =
        render_json("builtin:cloth:500", folder, {"--frames", "0..1", "--rays", "ao"});
    EXPECT_EQ(json["schema"], "morphray/1");
    EXPECT_EQ(json["command"], "render");
    EXPECT_EQ(json["scene"], "cloth");
    EXPECT_EQ(json["backend"], "cpu");
    EXPECT_EQ(json["rays"], "ao");
    EXPECT_EQ(json["complete"], true);
    EXPECT_EQ(json["width"], 24);
    EXPECT_GT(json["triangles"], 100);
    EXPECT_TRUE(json["version"].is_string());
    ASSERT_EQ(json["frames"].size(), 2u);
    for (const Json& frame : json["frames"]) {
        for (const char* hash : {"hits_hash", "image_hash", "bvh_hash"}) {
            const std::string text = frame.at(hash);
            EXPECT_EQ(text.size(), 16u) << hash;
            EXPECT_EQ(text.find_first_not_of("0123456789abcdef"), std::string::npos) << text;
        }
        for (const char* number :
             {"frame", "deform_ms", "upload_ms", "refit_ms", "rebuild_ms", "trace_ms", "total_ms",
              "rays", "hits", "misses", "occluded", "sah_cost"}) {
            EXPECT_TRUE(frame.at(number).is_number()) << number;
            EXPECT_GE(frame.at(number), 0) << number;
        }
        EXPECT_EQ(frame["hits"].get<int>() + frame["misses"].get<int>(), 24 * 24);
        EXPECT_EQ(frame["rays"].get<int>(), 24 * 24 + 16 * frame["hits"].get<int>());
        EXPECT_LE(frame["occluded"].get<int>(), 16 * frame["hits"].get<int>());
    }
    EXPECT_EQ(json["frames"][0]["update"], "build");
    EXPECT_EQ(json["frames"][1]["update"], "refit");
    EXPECT_EQ(json["frames"][1]["refit_on"], "cpu");
}

TEST(Render, IsLitUnlessRaysAreGiven) {
    TemporaryFolder folder;
    const Json lit = render_json("builtin:cloth:500", folder, {"--frames", "3"});
    EXPECT_EQ(lit["shading"], "lit");
    EXPECT_EQ(lit["samples"], 4);
    EXPECT_EQ(lit["rays"], "shadow, ao");
    const Json plain =
        render_json("builtin:cloth:500", folder, {"--frames", "3", "--rays", "shadow"});
    EXPECT_EQ(plain["shading"], "plain");
    EXPECT_EQ(plain["samples"], 1);
    EXPECT_EQ(plain["rays"], "shadow");
    const Words without_sky = {"--frames", "3", "--ao-samples", "0", "--samples", "1", "--flat"};
    const Json flat = render_json("builtin:cloth:500", folder, without_sky);
    EXPECT_EQ(flat["rays"], "shadow");
    EXPECT_EQ(flat["frames"][0]["hits_hash"], plain["frames"][0]["hits_hash"]);
    EXPECT_NE(flat["frames"][0]["image_hash"], plain["frames"][0]["image_hash"]);
}

TEST(Render, FalseColoursAreOneImageEach) {
    TemporaryFolder folder;
    std::set<std::string> images;
    for (const char* shading : {"lit", "plain", "normal", "depth", "prim"}) {
        const Json json =
            render_json("builtin:cloth:500", folder, {"--frames", "3", "--shading", shading});
        EXPECT_EQ(json["shading"], shading);
        images.insert(json["frames"][0]["image_hash"].get<std::string>());
        const std::string png = read_file(folder.path() / "out/frame_0003.png");
        EXPECT_EQ(png.find("Scale") != std::string::npos, shading == std::string("depth"))
            << shading;
    }
    EXPECT_EQ(images.size(), 5u);
}

TEST(Render, TheScaleOfDepthsIsThatOfTheBoundsBeforeTheEye) {
    const TemporaryFolder folder;
    const std::string scene = folder.write("t.obj", unit_triangle(4));
    const Words view = {"--shading", "depth", "--eye", "8,0,0", "--target", "0,0,0"};
    const std::string scale = "depths: 4 (white) to 8 (dark grey)";
    const Outcome outcome = render(scene, folder, view);
    EXPECT_EQ(outcome.err, "morphray: " + scale + '\n');
    EXPECT_TRUE(has(read_file(folder.path() / "out/frame_0000.png"), scale));
    Words quiet = view;
    quiet.emplace_back("-q");
    EXPECT_EQ(render(scene, folder, quiet).err, "");
}

TEST(Render, FilesStandOnAGroundUnlessItWouldHideThem) {
    // A triangle that stands on the ground; in the second frame it has fallen.
    TemporaryFolder folder;
    for (const int frame : {0, 1})
        folder.write(fmt::format("s/a_{}.obj", frame),
                     fmt::format("v 0 {0} 0\nv 1 {0} 0\nv 0 {1} 0\nf 1 2 3\n", -100 * frame,
                                 1 - 100 * frame));
    const std::string scene = folder.file("s");
    const auto frame = [&](int number, const std::string& of, Words more) {
        more.insert(more.end(), {"--samples", "1", "--frames", std::to_string(number)});
        return render_json(of, folder, more)["frames"][0];
    };
    const auto hash = [&](int number, const std::string& of, const Words& more) {
        return frame(number, of, more)["image_hash"].get<std::string>();
    };
    EXPECT_GT(frame(0, scene, {})["hits"], frame(0, scene, {"--ground", "off"})["hits"]);
    EXPECT_EQ(hash(0, scene, {}), hash(0, scene, {"--ground", "on"}));
    EXPECT_EQ(hash(0, "builtin:cloth:500", {}), hash(0, "builtin:cloth:500", {"--ground", "off"}));
    // From below, with files of data, and in other colours there is none.
    for (const Words& more : {Words{"--eye", "0.5,-9,3"}, Words{"--exr", "half"},
                              Words{"--hits", folder.file("h")}, Words{"--shading", "normal"}}) {
        Words off = more;
        off.insert(off.end(), {"--ground", "off"});
        EXPECT_EQ(hash(0, scene, more), hash(0, scene, off)) << more[0];
    }
    // The ground stays below a mesh that falls.
    const auto fallen = [&](const char* ground) {
        return frame(1, scene,
                     {"--eye", "0.5,-99,2", "--target", "0.5,-99.5,0", "--light", "0,-90,9",
                      "--shading", "prim", "--ground", ground});
    };
    EXPECT_GT(fallen("off")["hits"], 0);
    EXPECT_GT(fallen("on")["hits"], fallen("off")["hits"]);
}

TEST(Render, OutMayNameOneImage) {
    TemporaryFolder folder;
    const std::string file = folder.file("a/b.png");
    const auto to_file = [&](const char* frames) {
        return run({"render", "builtin:cloth:500", "--backend", "cpu", "--size", "24x24",
                    "--frames", frames, "--out", file});
    };
    EXPECT_EQ(to_file("3").code, 0);
    EXPECT_EQ(folder.names(), (Words{"a", "a/b.png"}));
    const Outcome several = to_file("3..4");
    EXPECT_EQ(several.code, 2);
    EXPECT_TRUE(has(several.err, "one image, but 2 frames"));
}

/// A folder with frames 0 to 3 of a sequence, of which the third is bad.
struct BadSequence : TemporaryFolder {
    BadSequence() {
        for (const char* frame : {"s/f_0.obj", "s/f_1.obj", "s/f_3.obj"})
            write(frame, unit_triangle());
        write("s/f_2.obj", "v 0 0 0\nv nan 0 0\nv 0 1 0\nf 1 2 3\n");
    }
};

TEST(Render, BadFrameInTheMiddleKeepsTheEarlierOnes) {
    const BadSequence folder;
    const TemporaryFolder out;
    const std::string json = out.file("report.json");
    const Outcome outcome = render(folder.file("s"), out, {"--json", json});
    EXPECT_EQ(outcome.code, 8) << outcome.err;
    EXPECT_EQ(lines(outcome.err).size(), 1u) << outcome.err;
    EXPECT_TRUE(outcome.err.starts_with(folder.file("s/f_2.obj:2: "))) << outcome.err;
    EXPECT_EQ(out.names(),
              (Words{"out", "out/frame_0000.png", "out/frame_0001.png", "report.json"}));
    const Json report = Json::parse(read_file(json));
    EXPECT_EQ(report["complete"], false);
    EXPECT_EQ(report["frames"].size(), 2u);
}

TEST(Render, BadFrameThatIsNotSelectedIsNotRead) {
    const BadSequence folder;
    const std::string scene = folder.file("s");
    for (const Outcome& outcome :
         {render(scene, folder, {"--frames", "0..1"}), run({"info", scene})}) {
        EXPECT_EQ(outcome.code, 0) << outcome.err;
        EXPECT_EQ(outcome.err, "");
    }
    // The error is about the frame that the tree is built at.
    const Outcome refused = render(scene, folder, {"--frames", "0..1", "--build-at", "2"});
    EXPECT_EQ(refused.code, 3);
    EXPECT_EQ(lines(refused.err).size(), 1u) << refused.err;
}

TEST(Render, FramesWithEqualNamesAreRefused) {
    TemporaryFolder folder;
    folder.write("s/f_0.obj", square_at(0));
    folder.write("s/f_1.obj", square_at(1));
    const Outcome outcome = render(folder.file("s"), folder, {"--frames", "0..0.00001:0.0000001"});
    EXPECT_EQ(outcome.code, 2) << outcome.err;
    EXPECT_TRUE(has(outcome.err, "two outputs go to "));
    EXPECT_FALSE(std::filesystem::exists(folder.path() / "out"));
}

/// A PNG file of two pixels.
std::string png_of(std::uint32_t first, std::uint32_t second) {
    const Image image{2, 1, {first, second}};
    const std::vector<std::byte> bytes = encode_png(image);
    return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

/// A folder with scene.obj, a square with a texture of two texels.
struct TexturedFolder : TemporaryFolder {
    TexturedFolder() {
        write("a.png", png_of(0xFF0000FF, 0xFF00FF00));
        write("a.mtl", "newmtl m\nmap_Kd a.png\n");
        write("scene.obj",
              "mtllib a.mtl\nusemtl m\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n"
              "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 2/2 3/3 4/4\n");
    }
};

Outcome render_textured(const TexturedFolder& folder, const Words& more = {}) {
    return run(words("render " + folder.file("scene.obj") +
                         " --backend cpu --size 24x16 --json - --out " + folder.file("out"),
                     more));
}

std::string image_hash(const Outcome& outcome) {
    return json_of(outcome)["frames"][0]["image_hash"];
}

TEST(RenderTextures, AreSeen) {
    const TexturedFolder folder;
    const Outcome outcome = render_textured(folder);
    EXPECT_EQ(outcome.err, "");
    const std::string hash = image_hash(outcome);
    folder.write("a.png", png_of(0xFFFFFFFF, 0xFFFFFFFF));
    EXPECT_NE(image_hash(render_textured(folder)), hash);
}

TEST(RenderTextures, OfJpegFilesDoNotDependOnInstructionSets) {
    for (const bool progressive : {false, true}) {
        const TexturedFolder folder;
        folder.write("a.png", jpeg_file(61, 35, {.progressive = progressive}));
        const auto hash = [&](Words environment) {
            return image_hash(run({"render", folder.file("scene.obj"), "--size", "128x96", "--out",
                                   folder.file("out"), "--json", "-", "--backend", "cpu"},
                                  {.environment = std::move(environment)}));
        };
        EXPECT_EQ(hash({"JSIMD_FORCENONE=1"}), hash({}));
    }
}

TEST(RenderTextures, MissingOneIsAWarning) {
    const TexturedFolder folder;
    std::filesystem::remove(folder.path() / "a.png");
    const Outcome outcome = render_textured(folder);
    EXPECT_EQ(outcome.code, 0);
    EXPECT_TRUE(has(outcome.err, "a.mtl: warning: map_Kd: "));
    EXPECT_TRUE(has(outcome.err, "no such file"));
}

TEST(RenderTextures, DamagedOneIsAnErrorUnlessLenient) {
    const TexturedFolder folder;
    folder.write("a.png", png_of(0xFF000001, 0xFF000002).substr(0, 50));
    const Outcome outcome = render_textured(folder);
    EXPECT_EQ(outcome.code, 3);
    EXPECT_TRUE(outcome.err.starts_with(folder.file("a.png: is not a PNG file that can be read")))
        << outcome.err;
    EXPECT_EQ(outcome.out, "");
    const Outcome lenient = render_textured(folder, {"--lenient"});
    EXPECT_EQ(lenient.code, 0) << lenient.err;
    EXPECT_TRUE(has(lenient.err, "a.png: warning: is not a PNG file"));
    // Plain images do not read textures.
    EXPECT_EQ(render_textured(folder, {"--shading", "plain"}).code, 0);
}

std::string data_uri(const std::string& bytes) {
    return "data:image/png;base64," + base64(std::as_bytes(std::span(bytes)));
}

/// A glTF file of a square with a texture of the image in `images[0]`.
GltfBuilder textured_gltf() {
    GltfBuilder builder;
    builder.add_mesh(
        {{"POSITION", builder.add_accessor<float>({0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0}, "VEC3")},
         {"TEXCOORD_0", builder.add_accessor<float>({0, 1, 1, 1, 1, 0, 0, 0}, "VEC2")}},
        {{"indices", builder.add_accessor<std::uint8_t>({0, 1, 2, 0, 2, 3}, "SCALAR")},
         {"material", 0}});
    builder.add("nodes", {{"mesh", 0}});
    builder.json["materials"] = {
        {{"pbrMetallicRoughness", {{"baseColorTexture", {{"index", 0}}}}}}};
    builder.json["textures"] = {{{"source", 0}}};
    return builder;
}

Outcome render_gltf(const TemporaryFolder& folder, const std::string& bytes) {
    return run(words("render " + folder.write("scene.gltf", bytes).native() +
                     " --backend cpu --size 24x16 --json - --out " + folder.file("out")));
}

TEST(RenderTextures, OfGltfFilesAreTheSameFromFilesBuffersAndDataUris) {
    const TemporaryFolder folder;
    for (const std::string& image : {png_of(0xFF0000FF, 0xFF00FF00), jpeg_file(16, 8, {})}) {
        folder.write("a.image", image);
        GltfBuilder builder = textured_gltf();
        builder.json["images"] = {{{"uri", "a.image"}}};
        const std::string hash = image_hash(render_gltf(folder, builder.gltf()));
        builder.json["images"] = {{{"uri", data_uri(image)}}};
        const Outcome in_uri = render_gltf(folder, builder.gltf());
        EXPECT_EQ(image_hash(in_uri), hash);
        EXPECT_EQ(in_uri.err, "");
        const int view = builder.add_view(std::vector<char>(image.begin(), image.end()));
        builder.json["images"] = {{{"bufferView", view}, {"mimeType", "image/png"}}};
        const Outcome in_buffer = render_gltf(folder, builder.gltf());
        EXPECT_EQ(image_hash(in_buffer), hash);
        EXPECT_EQ(in_buffer.err, "");
        EXPECT_EQ(image_hash(render_gltf(folder, builder.glb())), hash);
        builder.json.erase("textures");
        builder.json["materials"] = Json::array({Json::object()});
        EXPECT_NE(image_hash(render_gltf(folder, builder.gltf())), hash);
    }
}

TEST(RenderTextures, MasksMakeHoles) {
    const TemporaryFolder folder;
    GltfBuilder builder = textured_gltf();
    builder.json["images"] = {{{"uri", data_uri(png_of(0xFF0000FF, 0x0000FF00))}}};
    const std::string solid = image_hash(render_gltf(folder, builder.gltf()));
    builder.json["materials"][0]["alphaMode"] = "MASK";
    const Outcome outcome = render_gltf(folder, builder.gltf());
    EXPECT_EQ(outcome.err, "");
    EXPECT_NE(image_hash(outcome), solid);
    builder.json["materials"][0]["alphaCutoff"] = 0;
    EXPECT_EQ(image_hash(render_gltf(folder, builder.gltf())), solid);
}

TEST(RenderTextures, InfoCountsThem) {
    const TexturedFolder folder;
    const Outcome outcome = run({"info", folder.file("scene.obj")});
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    EXPECT_TRUE(has(outcome.out, "\ntextures        1 (2 triangles): a.png\n"));
    const Json report = Json::parse(run({"info", folder.file("scene.obj"), "--json", "-"}).out);
    ASSERT_EQ(report["textures"].size(), 1u);
    EXPECT_EQ(std::filesystem::path(std::string(report["textures"][0])).filename(), "a.png");
}

}  // namespace
}  // namespace mray::test
