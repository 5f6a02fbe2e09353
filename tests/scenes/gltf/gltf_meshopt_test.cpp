// Buffer views that EXT_meshopt_compression compresses.
#include <gtest/gtest.h>
#include <meshoptimizer.h>

#include <cmath>
#include <cstring>
#include <functional>
#include <string>
#include <vector>

#include "scenes/gltf/file/view_filters.h"
#include "tests/scenes/gltf/gltf_builder.h"
#include "tests/scenes/gltf/opened_gltf.h"
#include "tests/support/test_scene.h"

namespace mray {
namespace {

using namespace test;

std::string as_text(const std::vector<unsigned char>& bytes, std::size_t size) {
    return {reinterpret_cast<const char*>(bytes.data()), size};
}

template <class T>
std::string encoded_elements(const std::vector<T>& values, std::size_t count, std::size_t stride) {
    meshopt_encodeVertexVersion(0);
    std::vector<unsigned char> bytes(meshopt_encodeVertexBufferBound(count, stride));
    return as_text(bytes, meshopt_encodeVertexBuffer(bytes.data(), bytes.size(), values.data(),
                                                     count, stride));
}

std::string encoded_triangles(const std::vector<std::uint32_t>& indices, std::size_t vertices) {
    meshopt_encodeIndexVersion(1);
    std::vector<unsigned char> bytes(meshopt_encodeIndexBufferBound(indices.size(), vertices));
    return as_text(bytes, meshopt_encodeIndexBuffer(bytes.data(), bytes.size(), indices.data(),
                                                    indices.size()));
}

std::string encoded_indices(const std::vector<std::uint32_t>& indices, std::size_t vertices) {
    meshopt_encodeIndexVersion(1);
    std::vector<unsigned char> bytes(meshopt_encodeIndexSequenceBound(indices.size(), vertices));
    return as_text(bytes, meshopt_encodeIndexSequence(bytes.data(), bytes.size(), indices.data(),
                                                      indices.size()));
}

/// A file whose views of data lie in a buffer that is not there, with the compressed ones in the
/// first buffer.
class CompressedBuilder : public GltfBuilder {
public:
    CompressedBuilder() {
        json["extensionsUsed"] = {"EXT_meshopt_compression"};
        json["extensionsRequired"] = {"EXT_meshopt_compression"};
    }

    int add_compressed(const std::string& encoded, const char* mode, std::size_t count,
                       std::size_t stride, const char* filter = nullptr) {
        bytes.resize((bytes.size() + 3) / 4 * 4);
        Json extension = {{"buffer", 0},
                          {"byteOffset", bytes.size()},
                          {"byteLength", encoded.size()},
                          {"byteStride", stride},
                          {"count", count},
                          {"mode", mode}};
        if (filter != nullptr) extension["filter"] = filter;
        bytes += encoded;
        const std::size_t length = count * stride;
        const Json view = {{"buffer", 1},
                           {"byteOffset", placeholder_},
                           {"byteLength", length},
                           {"extensions", {{"EXT_meshopt_compression", extension}}}};
        placeholder_ += (length + 3) / 4 * 4;
        return add("bufferViews", view);
    }

    int add_elements(int view, int component, std::size_t count, const char* type) {
        return add(
            "accessors",
            {{"bufferView", view}, {"componentType", component}, {"count", count}, {"type", type}});
    }

    /// The file, its buffer beside the placeholder.
    std::string with_placeholder(const Json& placeholder = Json::object()) {
        Json second = {{"byteLength", placeholder_}};
        second.update(placeholder);
        json["buffers"] = {{{"byteLength", bytes.size()},
                            {"uri", "data:application/octet-stream;base64," +
                                        base64(std::as_bytes(std::span(bytes)))}},
                           second};
        return gltf();
    }

private:
    std::size_t placeholder_ = 0;
};

struct Grid {
    std::vector<float> positions;
    std::vector<std::uint32_t> indices;
    std::size_t vertex_count = 0;
};

Grid grid(std::uint32_t side) {
    Grid result;
    result.vertex_count = std::size_t{side} * side;
    for (std::uint32_t y = 0; y < side; ++y) {
        for (std::uint32_t x = 0; x < side; ++x) {
            const auto u = static_cast<float>(x), v = static_cast<float>(y);
            result.positions.insert(result.positions.end(), {u, v, 0.25f * u * v});
            if (x + 1 == side || y + 1 == side) continue;
            const std::uint32_t a = y * side + x;
            const std::uint32_t corners[] = {a, a + 1, a + side, a + 1, a + side + 1, a + side};
            result.indices.insert(result.indices.end(), std::begin(corners), std::end(corners));
        }
    }
    return result;
}

/// The grid with compressed positions, and with indices in this mode.
CompressedBuilder compressed_grid(const char* mode = "TRIANGLES") {
    const Grid g = grid(9);
    CompressedBuilder builder;
    const int positions = builder.add_elements(
        builder.add_compressed(encoded_elements(g.positions, g.vertex_count, 12), "ATTRIBUTES",
                               g.vertex_count, 12),
        5126, g.vertex_count, "VEC3");
    const bool is_sequence = std::string(mode) == "INDICES";
    const std::string encoded = is_sequence ? encoded_indices(g.indices, g.vertex_count)
                                            : encoded_triangles(g.indices, g.vertex_count);
    const int indices =
        builder.add_elements(builder.add_compressed(encoded, mode, g.indices.size(), 2), 5123,
                             g.indices.size(), "SCALAR");
    builder.add("nodes",
                {{"mesh", builder.add_mesh({{"POSITION", positions}}, {{"indices", indices}})}});
    return builder;
}

/// The triangles as sets of corners: the code for triangles may turn them.
std::vector<uvec3> turned(std::vector<uvec3> triangles) {
    for (uvec3& t : triangles) {
        while (t.x > t.y || t.x > t.z) t = {t.y, t.z, t.x};
    }
    return triangles;
}

TEST(GltfMeshopt, ViewsAreThoseBeforeCompression) {
    const Grid g = grid(9);
    GltfBuilder plain;
    plain.add("nodes",
              {{"mesh", plain.add_mesh({{"POSITION", plain.add_accessor(g.positions, "VEC3")}},
                                       {{"indices", plain.add_accessor(g.indices, "SCALAR")}})}});
    const OpenedGltf expected(plain.gltf());
    for (const char* const mode : {"TRIANGLES", "INDICES"}) {
        const OpenedGltf scene(compressed_grid(mode).with_placeholder());
        EXPECT_TRUE(scene.warnings().empty());
        EXPECT_EQ(scene.at(0), expected.at(0));
        EXPECT_EQ(turned(scene.clip().topology().triangles),
                  turned(expected.clip().topology().triangles));
    }
}

TEST(GltfMeshopt, BuffersForOtherReadersAreNotOpened) {
    CompressedBuilder builder = compressed_grid();
    const OpenedGltf without(builder.with_placeholder());
    const Json fallback = {{"uri", "missing.bin"},
                           {"extensions", {{"EXT_meshopt_compression", {{"fallback", true}}}}}};
    EXPECT_EQ(OpenedGltf(builder.with_placeholder(fallback)).at(0), without.at(0));
    EXPECT_NE(gltf_error(builder.with_placeholder({{"uri", "missing.bin"}})).find("missing.bin"),
              std::string::npos);
    // A view of the placeholder that is not compressed has no bytes.
    builder.json["bufferViews"][0].erase("extensions");
    EXPECT_EQ(gltf_error(builder.with_placeholder()),
              "scene.gltf: bufferViews[0].byteLength: bytes 0 to 972 are not in the buffer, which "
              "has 0");
}

struct BadCompression {
    std::function<void(Json& view, Json& extension)> change;
    /// The part of the message behind the file and the view.
    const char* message;
};

TEST(GltfMeshopt, WhatDoesNotFitIsRefusedWithItsPlace) {
    const std::vector<BadCompression> cases = {
        {[](Json&, Json& e) { e["mode"] = "TRIANGLE"; },
         ".mode: is 'TRIANGLE'; must be one of ATTRIBUTES, TRIANGLES, INDICES"},
        {[](Json&, Json& e) { e["filter"] = "COLOR"; },
         ".filter: is 'COLOR'; must be one of NONE, OCTAHEDRAL, QUATERNION, EXPONENTIAL"},
        {[](Json&, Json& e) { e["filter"] = "QUATERNION"; },
         ".byteStride: is 12, which its mode or filter does not allow"},
        {[](Json&, Json& e) { e["byteStride"] = 0; },
         ".byteStride: is 0, which its mode or filter does not allow"},
        {[](Json&, Json& e) { e["byteStride"] = 260; },
         ".byteStride: is 260, which its mode or filter does not allow"},
        {[](Json&, Json& e) { e["buffer"] = 2; }, ".buffer: is 2, but there are 2 buffers"},
        {[](Json&, Json& e) { e["buffer"] = 1; }, ".byteLength: bytes 0 to "},
        {[](Json&, Json& e) { e["byteLength"] = std::uint64_t{1} << 50; },
         ".byteLength: bytes 0 to 1125899906842624 are not in the buffer"},
        {[](Json&, Json& e) { e["byteLength"] = 20; }, ": its bytes are not compressed"},
        {[](Json& v, Json& e) {
             e["count"] = 1 << 20;
             v["byteLength"] = 12 << 20;
         },
         ".count: is 1048576, more elements than "},
        {[](Json&, Json& e) { e["count"] = std::uint64_t{1} << 53; },
         "!.byteLength: is 972, but 9007199254740992 elements of 12 bytes"},
        {[](Json& v, Json&) { v["byteStride"] = 16; },
         "!.byteStride: is 16, but the compressed elements have 12 bytes"},
    };
    const std::string view = "scene.gltf: bufferViews[0]";
    for (const BadCompression& bad : cases) {
        CompressedBuilder builder = compressed_grid();
        Json& changed = builder.json["bufferViews"][0];
        bad.change(changed, changed["extensions"]["EXT_meshopt_compression"]);
        const std::string expected =
            bad.message[0] == '!' ? view + (bad.message + 1)
                                  : view + ".extensions.EXT_meshopt_compression" + bad.message;
        const std::string text = gltf_error(builder.with_placeholder());
        EXPECT_EQ(text.substr(0, expected.size()), expected);
    }
}

TEST(GltfMeshopt, DamagedBytesNeverEndTheProgram) {
    const CompressedBuilder whole = compressed_grid();
    Random random(5);
    int refused = 0;
    for (int i = 0; i < 500; ++i) {
        CompressedBuilder builder = whole;
        for (int k = 0; k < 3; ++k) {
            builder.bytes[random.below(static_cast<std::uint32_t>(builder.bytes.size()))] =
                static_cast<char>(random.bits());
        }
        if (!gltf_error(builder.with_placeholder()).empty()) ++refused;
    }
    EXPECT_GT(refused, 0);
}

template <class T>
std::string bytes_of(const std::vector<T>& values) {
    return {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T)};
}

template <class T>
std::vector<T> values_of(const std::string& bytes) {
    std::vector<T> values(bytes.size() / sizeof(T));
    std::memcpy(values.data(), bytes.data(), bytes.size());
    return values;
}

/// Decodes by our filter and by that of the library, whose results may differ by one.
template <class T>
void expect_close(gltf::ViewFilter filter, const std::vector<T>& encoded,
                  void (*decode)(void*, std::size_t, std::size_t)) {
    std::string ours = bytes_of(encoded);
    gltf::apply_filter(filter, 4 * sizeof(T), ours);
    std::vector<T> theirs = encoded;
    decode(theirs.data(), theirs.size() / 4, 4 * sizeof(T));
    const std::vector<T> values = values_of<T>(ours);
    for (std::size_t i = 0; i < values.size(); ++i)
        ASSERT_LE(std::abs(values[i] - theirs[i]), 1) << i;
}

template <class T>
std::vector<T> octahedral_vectors(int bits) {
    Random random(7);
    const int one = (1 << (bits - 1)) - 1;
    std::vector<T> encoded;
    for (int i = 0; i < 4000; ++i) {
        for (int k = 0; k < 2; ++k)
            encoded.push_back(static_cast<T>(std::lround(random.real(-one, one))));
        encoded.push_back(static_cast<T>(one));
        encoded.push_back(static_cast<T>(i % 100));
    }
    return encoded;
}

TEST(GltfMeshopt, FiltersAreThoseOfTheLibrary) {
    expect_close(gltf::ViewFilter::kOctahedral, octahedral_vectors<std::int8_t>(8),
                 meshopt_decodeFilterOct);
    for (const int bits : {8, 12, 16}) {
        expect_close(gltf::ViewFilter::kOctahedral, octahedral_vectors<std::int16_t>(bits),
                     meshopt_decodeFilterOct);
    }
    for (const int bits : {8, 12, 16}) {
        std::vector<std::int16_t> quaternions = octahedral_vectors<std::int16_t>(bits);
        const int one = (1 << (bits - 1)) - 1;
        for (std::size_t i = 0; i < quaternions.size(); i += 4) {
            // The other components are at most the square root of 1/2.
            for (std::size_t k = 0; k < 2; ++k)
                quaternions[i + k] = static_cast<std::int16_t>(quaternions[i + k] / 2);
            quaternions[i + 2] = static_cast<std::int16_t>(quaternions[i] / 3);
            quaternions[i + 3] =
                static_cast<std::int16_t>((one & ~3) | static_cast<int>(i / 4 % 4));
        }
        expect_close(gltf::ViewFilter::kQuaternion, quaternions, meshopt_decodeFilterQuat);
    }
    Random random(9);
    std::vector<std::uint32_t> words;
    for (int i = 0; i < 4000; ++i) {
        const int exponent = static_cast<int>(random.below(200)) - 100;
        words.push_back(static_cast<std::uint32_t>(exponent) << 24 |
                        (static_cast<std::uint32_t>(random.bits()) & 0xFFFFFFu));
    }
    std::string ours = bytes_of(words);
    gltf::apply_filter(gltf::ViewFilter::kExponential, 4, ours);
    meshopt_decodeFilterExp(words.data(), words.size(), 4);
    const std::vector<std::uint32_t> values = values_of<std::uint32_t>(ours);
    for (std::size_t i = 0; i < values.size(); ++i) {
        // The library's product has a zero with the sign of the power.
        if ((words[i] & 0x7FFFFFFFu) == 0) continue;
        ASSERT_EQ(values[i], words[i]) << i;
    }
}

TEST(GltfMeshopt, FiltersAcceptAnyBytes) {
    Random random(11);
    for (int i = 0; i < 200; ++i) {
        std::string bytes(64, '\0');
        for (char& byte : bytes) byte = static_cast<char>(random.below(4) == 0 ? 0 : random.bits());
        using gltf::ViewFilter;
        for (const ViewFilter filter :
             {ViewFilter::kOctahedral, ViewFilter::kQuaternion, ViewFilter::kExponential}) {
            for (const std::size_t stride : {4u, 8u}) {
                std::string decoded = bytes;
                if (gltf::fits_filter(filter, stride)) gltf::apply_filter(filter, stride, decoded);
                EXPECT_EQ(decoded.size(), bytes.size());
            }
        }
    }
}

TEST(GltfMeshopt, FilteredNormalsAndRotationsAreRead) {
    // A triangle whose node turns by a quarter around z: (0, 0, s, s), the largest component is w.
    CompressedBuilder builder;
    const std::vector<float> corners = {0, 0, 0, 1, 0, 0, 0, 1, 0};
    const int positions = builder.add_elements(
        builder.add_compressed(encoded_elements(corners, 3, 12), "ATTRIBUTES", 3, 12), 5126, 3,
        "VEC3");
    // 1 stands for the square root of 1/2.
    const std::vector<std::int16_t> rotation = {0, 0, 0, 32767, 0, 0, 32767, 32767};
    const int rotations = builder.add_elements(
        builder.add_compressed(encoded_elements(rotation, 2, 8), "ATTRIBUTES", 2, 8, "QUATERNION"),
        5122, 2, "VEC4");
    builder.json["accessors"][static_cast<std::size_t>(rotations)]["normalized"] = true;
    builder.add("nodes", {{"mesh", builder.add_mesh({{"POSITION", positions}})}});
    builder.add_animation(0, "rotation", {0, 1}, rotations);
    const OpenedGltf scene(builder.with_placeholder());
    expect_point(scene.at(24)[1], 0, 1, 0, 1e-4);
    expect_point(scene.at(24)[2], -1, 0, 0, 1e-4);
}

}  // namespace
}  // namespace mray
