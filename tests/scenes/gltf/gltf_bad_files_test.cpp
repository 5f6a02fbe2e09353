// glTF files that are refused: each with the place and the reason.
#include <gtest/gtest.h>

#include <functional>
#include <limits>

#include "tests/scenes/gltf/gltf_builder.h"
#include "tests/scenes/gltf/opened_gltf.h"

namespace mray {
namespace {

using namespace test;

constexpr std::uint64_t kHuge = std::uint64_t{1} << 40;

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
    const char* name;
    std::function<void(Json&)> change;
    /// The part of the message behind the file.
    const char* message;
};

Json& primitive(Json& json) { return json["meshes"][0]["primitives"][0]; }

const std::vector<BadFile> kBadFiles = {
    {"no asset", [](Json& j) { j.erase("asset"); }, "has no member asset"},
    {"version 1", [](Json& j) { j["asset"]["version"] = "1.0"; },
     "asset.version: is '1.0'; only glTF 2.0 is read, convert the file"},
    {"later least version", [](Json& j) { j["asset"]["minVersion"] = "2.1"; },
     "asset.minVersion: is '2.1'"},
    {"Draco", [](Json& j) { j["extensionsRequired"] = {"KHR_draco_mesh_compression"}; },
     "extensionsRequired[0]: the extension 'KHR_draco_mesh_compression' is required"},
    {"nodes are no array", [](Json& j) { j["nodes"] = 3; }, "nodes: must be an array"},
    {"a node is no object", [](Json& j) { j["nodes"][1] = 3; }, "nodes[1]: must be an object"},
    {"index below 0", [](Json& j) { j["nodes"][0]["mesh"] = -1; },
     "nodes[0].mesh: is -1; must be a whole number from 0 on"},
    {"index with a fraction", [](Json& j) { j["nodes"][0]["mesh"] = 0.5; },
     "nodes[0].mesh: is 0.5; must be"},
    {"mesh that is not there", [](Json& j) { j["nodes"][0]["mesh"] = 7; },
     "nodes[0].mesh: is 7, but there are 1 meshes"},
    {"skin that is not there", [](Json& j) { j["nodes"][0]["skin"] = 1; },
     "nodes[0].skin: is 1, but there are 1 skins"},
    {"node that is its own child", [](Json& j) { j["nodes"][2]["children"] = {2}; },
     "nodes[2].children[0]: is 2, which is a child of nodes[1] already"},
    {"cycle of nodes",
     [](Json& j) {
         j["nodes"][2]["children"] = {1};
         j["scenes"][0]["nodes"] = {0};
     },
     "nodes[1]: is its own ancestor"},
    {"child twice",
     [](Json& j) {
         j["nodes"][1]["children"] = {2, 2};
     },
     "nodes[1].children[1]: is 2, which is a child of nodes[1] already"},
    {"scene with a node twice",
     [](Json& j) {
         j["scenes"][0]["nodes"] = {1, 0, 1};
     },
     "scenes[0].nodes[2]: is 1, which is there twice"},
    {"scene that is not there", [](Json& j) { j["scene"] = 1; },
     "scene: is 1, but there are 1 scenes"},
    {"matrix and translation",
     [](Json& j) { j["nodes"][2]["matrix"] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1}; },
     "nodes[2]: has both matrix and translation"},
    {"projective matrix",
     [](Json& j) { j["nodes"][1]["matrix"] = {1, 0, 0, 1, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1}; },
     "nodes[1].matrix: has a last row other than 0, 0, 0, 1"},
    {"matrix that moves",
     [](Json& j) { j["nodes"][1]["matrix"] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1}; },
     "nodes[1].matrix: stands in a node that an animation moves"},
    {"rotation of 0",
     [](Json& j) {
         j["nodes"][1]["rotation"] = {0, 0, 0, 0};
     },
     "nodes[1].rotation: has no direction"},
    {"translation of two numbers",
     [](Json& j) {
         j["nodes"][2]["translation"] = {1, 2};
     },
     "nodes[2].translation: has 2 numbers instead of 3"},
    {"buffer larger than the file", [](Json& j) { j["buffers"][0]["byteLength"] = kHuge; },
     "buffers[0].byteLength: is 1099511627776, but there are"},
    {"buffer of an absolute path", [](Json& j) { j["buffers"][0]["uri"] = "/etc/passwd"; },
     "names '/etc/passwd' by an absolute path"},
    {"buffer outside of the folder",
     [](Json& j) { j["buffers"][0]["uri"] = "..%2f..%2fetc/passwd"; },
     "names '../../etc/passwd', which lies outside of the scene's folder"},
    {"buffer of file:", [](Json& j) { j["buffers"][0]["uri"] = "file:///etc/passwd"; },
     "buffers[0].uri: 'file:///etc/passwd' is not followed"},
    {"buffer of an encoded scheme", [](Json& j) { j["buffers"][0]["uri"] = "http%3a//x/y"; },
     "buffers[0].uri: 'http://x/y' is not followed"},
    {"buffer of http:", [](Json& j) { j["buffers"][0]["uri"] = "http://x/y"; },
     "buffers[0].uri: 'http://x/y' is not followed"},
    {"buffer that is a folder", [](Json& j) { j["buffers"][0]["uri"] = "."; }, "is a folder"},
    {"buffer that is missing", [](Json& j) { j["buffers"][0]["uri"] = "no.bin"; }, "no such file"},
    {"broken percent", [](Json& j) { j["buffers"][0]["uri"] = "a%2"; },
     "buffers[0].uri: has a % without two hexadecimal digits"},
    {"data without base64", [](Json& j) { j["buffers"][0]["uri"] = "data:text/plain,abc"; },
     "buffers[0].uri: is a data: URI that is not in base 64"},
    {"damaged base64", [](Json& j) { j["buffers"][0]["uri"] = "data:;base64,ab*d"; },
     "buffers[0].uri: has characters that are not base 64, or is cut"},
    {"buffer without content", [](Json& j) { j["buffers"][0].erase("uri"); },
     "buffers[0]: has no uri, and the file has no binary chunk for it"},
    {"view past its buffer", [](Json& j) { j["bufferViews"][0]["byteLength"] = kHuge; },
     "bufferViews[0].byteLength: bytes 0 to 1099511627776 are not in the buffer"},
    {"view that begins past its buffer", [](Json& j) { j["bufferViews"][0]["byteOffset"] = kHuge; },
     "bufferViews[0].byteLength: bytes 1099511627776 to"},
    {"stride below the element", [](Json& j) { j["bufferViews"][0]["byteStride"] = 8; },
     "bufferViews[0].byteStride: is 8; elements have 12 bytes"},
    {"accessor past its view", [](Json& j) { j["accessors"][0]["count"] = 4; },
     "accessors[0]: bytes 0 to 48 are not in bufferViews[0], which has 36"},
    {"accessor of 2^31 - 1 elements", [](Json& j) { j["accessors"][0]["count"] = 2147483647; },
     "accessors[0]: bytes 0 to 25769803764 are not in bufferViews[0]"},
    {"accessor of 2^40 elements", [](Json& j) { j["accessors"][0]["count"] = kHuge; },
     "accessors[0].count: is 1099511627776; must be from 1 to 4294967294"},
    {"accessor of no elements", [](Json& j) { j["accessors"][0]["count"] = 0; },
     "accessors[0].count: is 0"},
    {"accessor of zeros alone",
     [](Json& j) {
         j["accessors"][0].erase("bufferView");
         j["accessors"][0]["count"] = 4000000000u;
     },
     "accessors[0].count: is 4000000000, but the accessor has no bufferView, and all buffers"},
    {"offset of 2^40", [](Json& j) { j["accessors"][4]["byteOffset"] = kHuge; },
     "accessors[4]: bytes 1099511627776 to 1099511627782 are not in bufferViews[4]"},
    {"unknown component", [](Json& j) { j["accessors"][0]["componentType"] = 5124; },
     "accessors[0].componentType: is 5124"},
    {"unknown type", [](Json& j) { j["accessors"][0]["type"] = "VEC5"; },
     "accessors[0].type: is 'VEC5'"},
    {"positions of two numbers", [](Json& j) { j["accessors"][0]["type"] = "VEC2"; },
     "accessors[0].type: must be VEC3 here"},
    {"sparse indices beyond the accessor",
     [](Json& j) {
         j["accessors"][3]["sparse"] = {{"count", 3},
                                        {"indices", {{"bufferView", 1}, {"componentType", 5121}}},
                                        {"values", {{"bufferView", 0}}}};
     },
     "accessors[3].sparse.indices: index 2 is 0; they must increase and stay below 3"},
    {"more sparse elements than elements",
     [](Json& j) {
         j["accessors"][3]["sparse"] = {{"count", 4}};
     },
     "accessors[3].sparse.count: is 4; must be from 1 to 3"},
    {"sparse values past their view",
     [](Json& j) {
         j["accessors"][3]["sparse"] = {{"count", 3},
                                        {"indices", {{"bufferView", 4}, {"componentType", 5123}}},
                                        {"values", {{"bufferView", 4}}}};
     },
     "accessors[3].sparse.values: bytes 0 to 36 are not in bufferViews[4], which has 6"},
    {"index beyond the vertices", [](Json& j) { j["accessors"][4]["bufferView"] = 2; },
     "primitives[0].indices: index 1 is 16256, but there are 3 vertices"},
    {"indices of floats", [](Json& j) { primitive(j)["indices"] = 6; }, "must be SCALAR here"},
    {"two corners", [](Json& j) { j["accessors"][4]["count"] = 2; },
     "meshes[0].primitives[0].indices: 2 corners are no triangles"},
    {"mode 7", [](Json& j) { primitive(j)["mode"] = 7; },
     "meshes[0].primitives[0].mode: is 7; must be from 0 to 6"},
    {"target of another count", [](Json& j) { j["accessors"][3]["count"] = 2; },
     "accessors[3].count: is 2, but the positions of its primitive are 3"},
    {"joints without weights", [](Json& j) { primitive(j)["attributes"].erase("WEIGHTS_0"); },
     "attributes: has no WEIGHTS_0"},
    {"joint beyond the skin", [](Json& j) { j["skins"][0]["joints"] = {1}; },
     "nodes[0].skin: has 1 joints, but meshes[0] uses joint 1"},
    {"skin without joints", [](Json& j) { j["skins"][0]["joints"] = Json::array(); },
     "skins[0].joints: has 0 joints"},
    {"joint that is not there",
     [](Json& j) {
         j["skins"][0]["joints"] = {1, 9};
     },
     "skins[0].joints[1]: is 9, but there are 3 nodes"},
    {"fewer matrices than joints", [](Json& j) { j["accessors"][5]["count"] = 1; },
     "skins[0].inverseBindMatrices: has 1 matrices for 2 joints"},
    {"weights of another count of targets",
     [](Json& j) {
         j["nodes"][0]["weights"] = {1, 2};
     },
     "nodes[0].weights: has 2 numbers for 1 morph targets"},
    {"skin without a mesh", [](Json& j) { j["nodes"][1]["skin"] = 0; },
     "nodes[1].skin: belongs to a mesh, which the node has not"},
    {"channel of a node that is not there",
     [](Json& j) { j["animations"][0]["channels"][0]["target"]["node"] = 3; },
     "animations[0].channels[0].target.node: is 3, but there are 3 nodes"},
    {"channel of an unknown path",
     [](Json& j) { j["animations"][0]["channels"][0]["target"]["path"] = "colour"; },
     "animations[0].channels[0].target.path: is 'colour'"},
    {"weights of a node without targets",
     [](Json& j) { j["animations"][0]["channels"][0]["target"]["path"] = "weights"; },
     "animations[0].channels[0].target: has no morph targets"},
    {"two channels of one property",
     [](Json& j) {
         Json& channels = j["animations"][0]["channels"];
         channels.push_back(Json(channels[0]));
     },
     "animations[0].channels[1].target: is that of another channel, too"},
    {"unknown interpolation",
     [](Json& j) { j["animations"][0]["samplers"][0]["interpolation"] = "BEZIER"; },
     "animations[0].samplers[0].interpolation: is 'BEZIER'"},
    {"spline without tangents",
     [](Json& j) { j["animations"][0]["samplers"][0]["interpolation"] = "CUBICSPLINE"; },
     "animations[0].samplers[0].output: has 8 numbers for 2 times of 12"},
    {"times of integers", [](Json& j) { j["animations"][0]["samplers"][0]["input"] = 4; },
     "accessors[4].componentType: must be 5126 (float) here"},
};

/// The full file with its buffer, as JSON.
Json full_json() { return Json::parse(full_file().gltf()); }

TEST(BadGltf, TheFileBeforeAnyChangeIsGood) {
    const OpenedGltf scene(full_file().gltf());
    EXPECT_EQ(scene.animation().last_frame(), 24);
    EXPECT_TRUE(scene.warnings().empty());
}

TEST(BadGltf, IsRefusedWithPlaceAndReason) {
    for (const BadFile& bad : kBadFiles) {
        Json json = full_json();
        bad.change(json);
        const std::string error = gltf_error(json.dump());
        EXPECT_TRUE(error.starts_with("scene.gltf: ")) << bad.name << ": " << error;
        EXPECT_NE(error.find(bad.message), std::string::npos) << bad.name << ": " << error;
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
    const float infinity = std::numeric_limits<float>::infinity();
    const std::string vertex =
        "attributes.POSITION: vertex 1 has a coordinate that is not finite or "
        "beyond 1e30; repair it";
    EXPECT_NE(error_with(0, 4, nan).find(vertex), std::string::npos);
    EXPECT_NE(error_with(0, 4, 1e31f).find(vertex), std::string::npos);
    EXPECT_EQ(error_with(0, 4, nan, {.lenient = true}), "");
    EXPECT_EQ(error_with(2, 4, -0.5f),
              "scene.gltf: meshes[0].primitives[0].attributes.WEIGHTS_0: vertex 1 has the weight "
              "-0.5; must be finite and at least 0");
    EXPECT_NE(error_with(2, 4, nan).find("has the weight nan"), std::string::npos);
    EXPECT_NE(error_with(2, 0, 0.0f).find("vertex 0 has no weight above 0; repair it"),
              std::string::npos);
    EXPECT_EQ(error_with(2, 0, 0.0f, {.lenient = true}), "");
    EXPECT_NE(error_with(3, 5, infinity).find("element 1 is not finite"), std::string::npos);
    EXPECT_NE(error_with(5, 20, nan).find("matrix 1 is not finite"), std::string::npos);
    EXPECT_NE(error_with(6, 1, nan).find("number 1 is not finite"), std::string::npos);
    EXPECT_NE(error_with(7, 0, 1.0f).find("times 0 and 1 are equal; repair them"),
              std::string::npos);
    EXPECT_EQ(error_with(7, 0, 1.0f, {.lenient = true}), "");
    EXPECT_NE(error_with(7, 0, 2.0f, {.lenient = true}).find("times must increase"),
              std::string::npos);
    EXPECT_NE(error_with(7, 0, -1.0f).find("time 0 is -1"), std::string::npos);
    EXPECT_NE(error_with(7, 1, 1e9f).find("time 1 is 1000000000"), std::string::npos);
    EXPECT_NE(error_with(1, 5, std::uint8_t{255}).find("uses joint 255"), std::string::npos);
    EXPECT_NE(error_with(4, 2, std::uint16_t{65535}).find("index 2 is 65535"), std::string::npos);
}

TEST(BadGltf, ALinkOutOfTheFolderIsNotFollowed) {
    const TemporaryFolder outside;
    const GltfBuilder builder = triangle_file();
    const std::string secret = outside.write("secret.bin", builder.bytes);
    const TemporaryFolder folder;
    std::filesystem::create_symlink(secret, folder.path() / "a.bin");
    Json json = builder.json;
    json["buffers"] = Json::array({{{"byteLength", builder.bytes.size()}, {"uri", "a.bin"}}});
    const std::string path = folder.write("scene.gltf", json.dump());
    EXPECT_NE(message_of([&] { open_scene(path); }).find("lies outside of the scene's folder"),
              std::string::npos);
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
    EXPECT_NE(error.find("a.glb: nodes[26843].mesh: all instances have more than 2^28 triangles or "
                         "2^22 morph targets; split the scene"),
              std::string::npos)
        << error;
}

}  // namespace
}  // namespace mray
