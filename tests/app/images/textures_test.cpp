// Textures of OBJ files in rendered images.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "common/image/png.h"
#include "tests/app/images/image_files.h"
#include "tests/app/program.h"
#include "tests/scenes/gltf/gltf_builder.h"
#include "tests/support/base64.h"

namespace mray::test {
namespace {

using Names = std::vector<std::string>;

std::string png_of(std::uint32_t first, std::uint32_t second) {
    const Image image{2, 1, {first | 0xFF000000, second | 0xFF000000}};
    const std::vector<std::byte> bytes = encode_png(image);
    return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

/// A folder with scene.obj, a square with a texture of two texels.
struct TexturedFolder : TemporaryFolder {
    TexturedFolder() {
        write("a.png", png_of(0x0000FF, 0x00FF00));
        write("a.mtl", "newmtl m\nmap_Kd a.png\n");
        write("scene.obj", text(0));
    }
    static std::string text(int z) {
        const std::string end = fmt::format(" {}\n", z);
        return "mtllib a.mtl\nusemtl m\nv 0 0" + end + "v 1 0" + end + "v 1 1" + end + "v 0 1" +
               end + "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 2/2 3/3 4/4\n";
    }
};

Outcome render_textured(const TexturedFolder& folder, Names more = {}) {
    Names all = {"render", folder.file("scene.obj"), "--size", "24x16",
                 "--out",  folder.file("out"),       "--json", "-"};
    all.insert(all.end(), more.begin(), more.end());
    return run(all);
}

std::string image_hash(const Outcome& outcome) {
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    return Json::parse(outcome.out)["frames"][0]["image_hash"];
}

TEST(RenderTextures, AreTheSameOnEveryBackend) {
    const TexturedFolder folder;
    const Outcome outcome = render_textured(folder, {"--backend", "cpu"});
    EXPECT_EQ(outcome.err, "");
    const std::string hash = image_hash(outcome);
    EXPECT_EQ(image_hash(render_textured(folder, {"--backend", "brute"})), hash);
    EXPECT_EQ(image_hash(render_textured(folder, {"--backend", "cpu", "--simd", "off"})), hash);
#ifdef MORPHRAY_HAS_VULKAN
    EXPECT_EQ(image_hash(render_textured(folder, {"--backend", "vulkan"})), hash);
#endif
    folder.write("a.png", png_of(0xFFFFFF, 0xFFFFFF));
    EXPECT_NE(image_hash(render_textured(folder, {"--backend", "cpu"})), hash);
}

TEST(RenderTextures, OfJpegFilesDoNotDependOnInstructionSets) {
    for (const bool progressive : {false, true}) {
        const TexturedFolder folder;
        folder.write("a.png", jpeg_file(61, 35, {.progressive = progressive}));
        const auto hash = [&](Names environment) {
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
    const Outcome outcome = render_textured(folder, {"--backend", "cpu"});
    EXPECT_EQ(outcome.code, 0);
    EXPECT_NE(outcome.err.find("a.mtl: warning: map_Kd: "), std::string::npos) << outcome.err;
    EXPECT_NE(outcome.err.find("no such file"), std::string::npos) << outcome.err;
}

TEST(RenderTextures, DamagedOneIsAnErrorUnlessLenient) {
    const TexturedFolder folder;
    folder.write("a.png", png_of(1, 2).substr(0, 50));
    const Outcome outcome = render_textured(folder, {"--backend", "cpu"});
    EXPECT_EQ(outcome.code, 3);
    EXPECT_TRUE(outcome.err.starts_with(folder.file("a.png: is not a PNG file that can be read")))
        << outcome.err;
    EXPECT_EQ(outcome.out, "");
    const Outcome lenient = render_textured(folder, {"--backend", "cpu", "--lenient"});
    EXPECT_EQ(lenient.code, 0) << lenient.err;
    EXPECT_NE(lenient.err.find("a.png: warning: is not a PNG file"), std::string::npos)
        << lenient.err;
    // Plain images do not read textures.
    EXPECT_EQ(render_textured(folder, {"--backend", "cpu", "--shading", "plain"}).code, 0);
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

Outcome render_gltf(const TemporaryFolder& folder, const std::string& bytes, Names more = {}) {
    Names all = {"render", folder.write("scene.gltf", bytes),
                 "--size", "24x16",
                 "--out",  folder.file("out"),
                 "--json", "-"};
    if (std::find(more.begin(), more.end(), "--backend") == more.end())
        all.insert(all.end(), {"--backend", "cpu"});
    all.insert(all.end(), more.begin(), more.end());
    return run(all);
}

TEST(RenderTextures, OfGltfFilesAreTheSameFromFilesBuffersAndDataUris) {
    const TemporaryFolder folder;
    for (const std::string& image : {png_of(0x0000FF, 0x00FF00), jpeg_file(16, 8, {})}) {
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

TEST(RenderTextures, MasksMakeTheSameHolesOnEveryBackend) {
    const TemporaryFolder folder;
    const Image image{2, 1, {0xFF0000FFu, 0x0000FF00u}};
    const std::vector<std::byte> bytes = encode_png(image);
    GltfBuilder builder = textured_gltf();
    builder.json["images"] = {
        {{"uri", data_uri({reinterpret_cast<const char*>(bytes.data()), bytes.size()})}}};
    const std::string solid = image_hash(render_gltf(folder, builder.gltf()));
    builder.json["materials"][0]["alphaMode"] = "MASK";
    const Outcome outcome = render_gltf(folder, builder.gltf());
    EXPECT_EQ(outcome.err, "");
    const std::string hash = image_hash(outcome);
    EXPECT_NE(hash, solid);
    EXPECT_EQ(image_hash(render_gltf(folder, builder.gltf(), {"--simd", "off"})), hash);
    EXPECT_EQ(image_hash(render_gltf(folder, builder.gltf(), {"--backend", "brute"})), hash);
#ifdef MORPHRAY_HAS_VULKAN
    EXPECT_EQ(image_hash(render_gltf(folder, builder.gltf(), {"--backend", "vulkan"})), hash);
#endif
    builder.json["materials"][0]["alphaCutoff"] = 0;
    EXPECT_EQ(image_hash(render_gltf(folder, builder.gltf())), solid);
}

TEST(RenderTextures, InADataUriChangeTheHashOfTheScene) {
    const TemporaryFolder folder;
    const auto hash_with = [&](const std::string& image) {
        GltfBuilder builder = textured_gltf();
        builder.json["images"] = {{{"uri", data_uri(image)}}};
        EXPECT_EQ(render_gltf(folder, builder.gltf()).code, 0);
        const std::string png = read_file(folder.path() / "out/frame_0000.png");
        return png.substr(png.find("Scene hash"), 40);
    };
    const std::string first = hash_with(png_of(1, 2));
    EXPECT_EQ(hash_with(png_of(1, 2)), first);
    EXPECT_NE(hash_with(png_of(0xFFFFFF, 0xFFFFFF)), first);
}

TEST(RenderTextures, InfoCountsThem) {
    const TexturedFolder folder;
    const Outcome outcome = run({"info", folder.file("scene.obj")});
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    EXPECT_NE(outcome.out.find("\ntextures        1 (2 triangles): a.png\n"), std::string::npos)
        << outcome.out;
    const Json report = Json::parse(run({"info", folder.file("scene.obj"), "--json", "-"}).out);
    ASSERT_EQ(report["textures"].size(), 1u);
    EXPECT_EQ(std::filesystem::path(std::string(report["textures"][0])).filename(), "a.png");
}

}  // namespace
}  // namespace mray::test
