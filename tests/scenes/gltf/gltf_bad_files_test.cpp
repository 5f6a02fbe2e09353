// glTF files that are refused, each with the place and the reason, and files that are cut.
#include <gtest/gtest.h>

#include <limits>

#include "common/base/errors.h"
#include "tests/scenes/gltf/gltf_builder.h"
#include "tests/scenes/gltf/opened_gltf.h"

namespace mray {
namespace {

using namespace test;

/// A skinned, morphed and animated triangle: something of everything.
GltfBuilder full_file() {
    GltfBuilder builder;
    const int position = builder.add_accessor<float>({0, 0, 0, 1, 0, 0, 0, 1, 0}, "VEC3");  // 0
    const int joints =
        builder.add_accessor<std::uint8_t>({0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0}, "VEC4");  // 1
    const int weights = builder.add_accessor<float>({1, 0, 0, 0, 0.5f, 0.5f, 0, 0, 0, 1, 0, 0},
                                                    "VEC4");                             // 2
    const int delta = builder.add_accessor<float>({0, 0, 1, 0, 0, 1, 0, 0, 1}, "VEC3");  // 3
    const int indices = builder.add_accessor<std::uint16_t>({0, 1, 2}, "SCALAR");        // 4
    std::vector<float> identity(32);
    for (std::size_t i = 0; i < 16; i += 5) identity[i] = identity[16 + i] = 1;
    const int matrices = builder.add_accessor(identity, "MAT4");  // 5
    const int mesh = builder.add_mesh(
        {{"POSITION", position}, {"JOINTS_0", joints}, {"WEIGHTS_0", weights}},
        {{"indices", indices}, {"targets", Json::array({{{"POSITION", delta}}})}, {"material", 0}});
    builder.json["materials"] =
        Json::array({{{"pbrMetallicRoughness", {{"baseColorFactor", {1, 1, 1, 1}}}}}});
    builder.json["skins"] = Json::array({{{"joints", {1, 2}}, {"inverseBindMatrices", matrices}}});
    builder.add("nodes", {{"mesh", mesh}, {"skin", 0}});
    builder.add("nodes", {{"children", {2}}});
    builder.add("nodes", {{"translation", {0, 0, 0}}});
    builder.json["scenes"] = Json::array({{{"nodes", {0, 1}}}});
    const int turns = builder.add_accessor<float>({0, 0, 0, 1, 0, 0, 1, 0}, "VEC4");  // 6
    builder.add_animation(1, "rotation", {0, 1}, turns);                              // 7
    return builder;
}

struct BadFile {
    /// A member of the full file and its new value as JSON; empty: without it.
    const char* pointer;
    const char* value;
    /// The part of the message behind the file.
    const char* message;
};

const BadFile kBadFiles[] = {
    {"/asset", "", "has no member asset"},
    {"/asset/version", R"("1.0")",
     "asset.version: is '1.0'; only glTF 2.0 is read, convert the file"},
    {"/extensionsRequired", R"(["KHR_draco_mesh_compression"])",
     "extensionsRequired[0]: the extension 'KHR_draco_mesh_compression' is required"},
    {"/nodes", "3", "nodes: must be an array"},
    {"/nodes/1", "3", "nodes[1]: must be an object"},
    {"/nodes/0/mesh", "-1", "nodes[0].mesh: is -1; must be a whole number from 0 on"},
    {"/nodes/0/mesh", "0.5", "nodes[0].mesh: is 0.5; must be"},
    {"/nodes/0/mesh", "7", "nodes[0].mesh: is 7, but there are 1 meshes"},
    {"/nodes/0/skin", "1", "nodes[0].skin: is 1, but there are 1 skins"},
    {"/nodes/2/children", "[2]",
     "nodes[2].children[0]: is 2, which is a child of nodes[1] already"},
    {"/nodes/2/children", "[1]", "nodes[1]: is its own ancestor"},
    {"/nodes/1/children", "[2, 2]",
     "nodes[1].children[1]: is 2, which is a child of nodes[1] already"},
    {"/scenes/0/nodes", "[1, 0, 1]", "scenes[0].nodes[2]: is 1, which is there twice"},
    {"/scenes/0/nodes", "[0, 2]",
     "scenes[0].nodes[1]: is 2, which is a child of nodes[1]; scenes list roots"},
    {"/scene", "1", "scene: is 1, but there are 1 scenes"},
    {"/nodes/2/matrix", "[1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]",
     "nodes[2]: has both matrix and translation"},
    {"/nodes/1/matrix", "[1, 0, 0, 1, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]",
     "nodes[1].matrix: has a last row other than 0, 0, 0, 1"},
    {"/nodes/1/matrix", "[1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]",
     "nodes[1].matrix: stands in a node that an animation moves"},
    {"/nodes/1/rotation", "[0, 0, 0, 0]", "nodes[1].rotation: has no direction"},
    {"/nodes/2/translation", "[1, 2]", "nodes[2].translation: has 2 numbers instead of 3"},
    {"/buffers/0/byteLength", "1099511627776",
     "buffers[0].byteLength: is 1099511627776, but there are"},
    {"/buffers/0/uri", R"("/etc/passwd")", "names '/etc/passwd' by an absolute path"},
    {"/buffers/0/uri", R"("..%2f..%2fetc/passwd")",
     "names '../../etc/passwd', which lies outside of the scene's folder"},
    {"/buffers/0/uri", R"("file:///etc/passwd")",
     "buffers[0].uri: 'file:///etc/passwd' is not followed"},
    {"/buffers/0/uri", R"("http%3a//x/y")", "buffers[0].uri: 'http://x/y' is not followed"},
    {"/buffers/0/uri", R"(".")", "is a folder"},
    {"/buffers/0/uri", R"("no.bin")", "no such file"},
    {"/buffers/0/uri", R"("a%2")", "buffers[0].uri: has a % without two hexadecimal digits"},
    {"/buffers/0/uri", R"("data:text/plain,abc")",
     "buffers[0].uri: is a data: URI that is not in base 64"},
    {"/buffers/0/uri", R"("data:;base64,ab*d")",
     "buffers[0].uri: has characters that are not base 64, or is cut"},
    {"/buffers/0/uri", "", "buffers[0]: has no uri, and the file has no binary chunk for it"},
    {"/bufferViews/0/byteLength", "1099511627776",
     "bufferViews[0].byteLength: bytes 0 to 1099511627776 are not in the buffer"},
    {"/bufferViews/0/byteOffset", "1099511627776",
     "bufferViews[0].byteLength: bytes 1099511627776 to"},
    {"/bufferViews/0/byteStride", "8", "bufferViews[0].byteStride: is 8; elements have 12 bytes"},
    {"/accessors/0/count", "4",
     "accessors[0]: bytes 0 to 48 are not in bufferViews[0], which has 36"},
    {"/accessors/0/count", "2147483647",
     "accessors[0]: bytes 0 to 25769803764 are not in bufferViews[0]"},
    {"/accessors/0/count", "1099511627776",
     "accessors[0].count: is 1099511627776; must be from 1 to 4294967294"},
    {"/accessors/0/count", "0", "accessors[0].count: is 0"},
    {"/accessors/0", R"({"componentType": 5126, "count": 4000000000, "type": "VEC3"})",
     "accessors[0].count: is 4000000000, but the accessor has no bufferView, and all buffers"},
    {"/accessors/4/byteOffset", "1099511627776",
     "accessors[4]: bytes 1099511627776 to 1099511627782 are not in bufferViews[4]"},
    {"/accessors/0/componentType", "5124", "accessors[0].componentType: is 5124"},
    {"/accessors/0/type", R"("VEC5")", "accessors[0].type: is 'VEC5'"},
    {"/accessors/0/type", R"("VEC2")", "accessors[0].type: is 'VEC2'; must be VEC3 here"},
    {"/accessors/3/sparse",
     R"({"count":3,"indices":{"bufferView":1,"componentType":5121},"values":{"bufferView":0}})",
     "accessors[3].sparse.indices: index 2 is 0; they must increase and stay below 3"},
    {"/accessors/3/sparse", R"({"count": 4})",
     "accessors[3].sparse.count: is 4; must be from 1 to 3"},
    {"/accessors/3/sparse",
     R"({"count":3,"indices":{"bufferView":4,"componentType":5123},"values":{"bufferView":4}})",
     "accessors[3].sparse.values: bytes 0 to 36 are not in bufferViews[4], which has 6"},
    {"/accessors/4/bufferView", "2",
     "primitives[0].indices: index 1 is 16256, but there are 3 vertices"},
    {"/meshes/0/primitives/0/indices", "6", "must be SCALAR here"},
    {"/accessors/4/count", "2", "meshes[0].primitives[0].indices: 2 corners are no triangles"},
    {"/meshes/0/primitives/0/mode", "7", "meshes[0].primitives[0].mode: is 7; must be from 0 to 6"},
    {"/accessors/3/count", "2",
     "accessors[3].count: is 2, but the positions of its primitive are 3"},
    {"/meshes/0/primitives/0/attributes/WEIGHTS_0", "", "attributes: has no WEIGHTS_0"},
    {"/skins/0/joints", "[1]", "nodes[0].skin: has 1 joints, but meshes[0] uses joint 1"},
    {"/skins/0/joints", "[]", "skins[0].joints: has 0 joints"},
    {"/skins/0/joints", "[1, 9]", "skins[0].joints[1]: is 9, but there are 3 nodes"},
    {"/accessors/5/count", "1", "skins[0].inverseBindMatrices: has 1 matrices for 2 joints"},
    {"/nodes/0/weights", "[1, 2]", "nodes[0].weights: has 2 numbers for 1 morph targets"},
    {"/nodes/1/skin", "0", "nodes[1].skin: belongs to a mesh, which the node has not"},
    {"/animations/0/channels/0/target/node", "3",
     "animations[0].channels[0].target.node: is 3, but there are 3 nodes"},
    {"/animations/0/channels/0/target/path", R"("colour")",
     "animations[0].channels[0].target.path: is 'colour'"},
    {"/animations/0/channels/0/target/path", R"("weights")",
     "animations[0].channels[0].target: has no morph targets"},
    {"/animations/0/channels/1", R"({"sampler": 0, "target": {"node": 1, "path": "rotation"}})",
     "animations[0].channels[1].target: is that of another channel, too"},
    {"/animations/0/samplers/0/interpolation", R"("BEZIER")",
     "animations[0].samplers[0].interpolation: is 'BEZIER'"},
    {"/animations/0/samplers/0/interpolation", R"("CUBICSPLINE")",
     "animations[0].samplers[0].output: has 8 numbers for 2 times of 12"},
    {"/accessors/7/componentType", "5125",
     "accessors[7].componentType: must be 5126 (float) or an integer of 8 or 16 bits here"},
};

TEST(BadGltf, TheFileBeforeAnyChangeIsGood) {
    const OpenedGltf scene(full_file().gltf());
    EXPECT_EQ(scene.animation->last_frame(), 24);
    EXPECT_TRUE(scene.warnings.empty());
}

TEST(BadGltf, IsRefusedWithPlaceAndReason) {
    const Json good = Json::parse(full_file().gltf());
    for (const BadFile& bad : kBadFiles) {
        const std::string error = gltf_error(changed(good, bad.pointer, bad.value).dump());
        EXPECT_TRUE(error.starts_with("scene.gltf: ")) << bad.pointer << ": " << error;
        EXPECT_TRUE(has(error, bad.message)) << bad.pointer;
    }
}

/// The error after `bytes` have been written over an accessor's first ones.
template <class T>
std::string error_with(int accessor, std::size_t index, T value,
                       const AnimationOptions& options = {}) {
    GltfBuilder builder = full_file();
    const Json& view =
        builder.json["bufferViews"]
                    [builder.json["accessors"][static_cast<std::size_t>(accessor)]["bufferView"]
                         .get<std::size_t>()];
    std::memcpy(&builder.bytes[view["byteOffset"].get<std::size_t>() + index * sizeof value],
                &value, sizeof value);
    return gltf_error(builder.gltf(), options);
}

TEST(BadGltf, NumbersThatCannotBe) {
    const float nan = std::numeric_limits<float>::quiet_NaN();
    const std::string vertex =
        "frame 0: vertex 1 has a coordinate that is not finite or beyond 1e30; repair it";
    EXPECT_TRUE(has(error_with(0, 4, nan), vertex));
    EXPECT_TRUE(has(error_with(5, 20, nan), vertex));
    EXPECT_TRUE(has(error_with(0, 4, 1e31f), vertex));
    EXPECT_EQ(error_with(0, 4, nan, {.lenient = true}), "");
    EXPECT_EQ(error_with(2, 4, -0.5f),
              "scene.gltf: meshes[0].primitives[0].attributes.WEIGHTS_0: vertex 1 has the weight "
              "-0.5; must be finite and at least 0");
    EXPECT_TRUE(has(error_with(2, 4, nan), "has the weight nan"));
    EXPECT_TRUE(has(error_with(2, 0, 0.0f), "vertex 0 has no weight above 0"));
    EXPECT_TRUE(has(error_with(6, 1, nan), "number 1 is not finite"));
    EXPECT_TRUE(has(error_with(7, 0, 1.0f), "time 1 is 1; times must increase"));
    EXPECT_TRUE(has(error_with(7, 0, -1.0f), "time 0 is -1; times must increase, from 0 to"));
    EXPECT_TRUE(has(error_with(7, 0, nan, {.lenient = true}), "is not finite"));
    EXPECT_TRUE(has(error_with(7, 1, 1e9f), "time 1 is 1000000000"));
    EXPECT_TRUE(has(error_with(1, 5, std::uint8_t{255}), "uses joint 255"));
    EXPECT_TRUE(has(error_with(4, 2, std::uint16_t{65535}), "index 2 is 65535"));
}

TEST(BadGltf, TextThatIsNoGltf) {
    EXPECT_EQ(gltf_error(""), "scene.gltf: byte 1 of its text is not JSON; is it complete?");
    EXPECT_EQ(gltf_error("\x89PNG\r\n\x1a\n", {}, "a.glb"),
              "a.glb: byte 1 of its text is not JSON; is it complete?");
    EXPECT_EQ(gltf_error("[]"), "scene.gltf: must be an object");
    EXPECT_EQ(gltf_error(R"({"asset": {"version": "2.0"}, "scene": 1e999})"),
              "scene.gltf: JSON has a number that is too large");
    EXPECT_EQ(gltf_error(std::string(1000000, '[')),
              "scene.gltf: byte 1000001 of its text is not JSON; is it complete?");
}

TEST(BadGltf, TooManyInstancesAreRefusedWithTheirPlace) {
    GltfBuilder builder;
    std::vector<std::uint32_t> indices(30000);
    const int mesh = builder.add_mesh(
        {{"POSITION", builder.add_accessor<float>({0, 0, 0, 1, 0, 0, 0, 1, 0}, "VEC3")}},
        {{"indices", builder.add_accessor(indices, "SCALAR")}});
    for (int i = 0; i < 27000; ++i) builder.add("nodes", {{"mesh", mesh}});
    const TemporaryFolder folder;
    const std::string path = folder.write("a.glb", builder.glb());
    EXPECT_EQ(kind_of([&] { open_scene(path); }), ErrorKind::kBadInput);
    const std::string error = message_of([&] { open_scene(path); });
    EXPECT_TRUE(has(error,
                    "a.glb: nodes[26843].mesh: all nodes have more than 2^28 triangles or "
                    "2^22 morph targets; split the scene"));
}

std::string small_glb() {
    GltfBuilder builder = triangle_file();
    const int values = builder.add_accessor<float>({0, 0, 0, 1, 0, 0}, "VEC3");
    builder.add_animation(0, "translation", {0, 1}, values);
    return builder.glb();
}

std::string with_word(std::string bytes, std::size_t at, std::uint32_t word) {
    std::memcpy(&bytes[at], &word, sizeof word);
    return bytes;
}

TEST(DamagedGltf, CutAtAnyByteIsRefused) {
    const std::string bytes = small_glb();
    for (std::size_t size = 0; size < bytes.size(); ++size) {
        const std::string error = gltf_error(bytes.substr(0, size), {}, "a.glb");
        EXPECT_TRUE(error.starts_with("a.glb: ")) << size << ": " << error;
    }
    const std::string text = triangle_file().gltf();
    for (std::size_t size = 0; size < text.size(); ++size) {
        const std::string error = gltf_error(text.substr(0, size));
        EXPECT_TRUE(error.starts_with("scene.gltf: ")) << size << ": " << error;
    }
    EXPECT_EQ(gltf_error(bytes, {}, "a.glb"), "");
}

TEST(DamagedGltf, LengthsOfTheContainer) {
    const std::string bytes = small_glb();
    const std::uint32_t json_size = [&] {
        std::uint32_t size = 0;
        std::memcpy(&size, &bytes[12], sizeof size);
        return size;
    }();
    const std::size_t binary = 20 + json_size;
    for (const std::size_t field : {std::size_t{4}, std::size_t{8}, std::size_t{12}, binary}) {
        for (const std::uint32_t value : {0u, 1u, 4u, 0x7FFFFFFFu, 0xFFFFFFFFu}) {
            const std::string error = gltf_error(with_word(bytes, field, value), {}, "a.glb");
            EXPECT_TRUE(error.starts_with("a.glb: ")) << field << " " << value << ": " << error;
        }
    }
    EXPECT_EQ(gltf_error(with_word(bytes, 4, 1), {}, "a.glb"),
              "a.glb: byte 4: has version 1; only 2 is known");
    EXPECT_EQ(gltf_error(with_word(bytes, 16, 0), {}, "a.glb"),
              "a.glb: byte 16: the first chunk is not JSON");
}

}  // namespace
}  // namespace mray
