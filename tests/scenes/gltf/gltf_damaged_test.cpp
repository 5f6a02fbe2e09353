// Files that were cut, and files whose lengths are wrong.
#include <gtest/gtest.h>

#include "common/base/errors.h"
#include "tests/scenes/gltf/gltf_builder.h"
#include "tests/scenes/gltf/opened_gltf.h"

namespace mray {
namespace {

using namespace test;

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

TEST(DamagedGltf, AHundredBytesThatClaimFourGibibytes) {
    for (
        const char* const text :
        {R"({"asset":{"version":"2.0"},"buffers":[{"byteLength":4294967296,"uri":"data:;base64,AAAA"}]})",
         R"({"asset":{"version":"2.0"},"accessors":[{"componentType":5126,"count":4000000000,"type":"MAT4"}],
              "meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],"nodes":[{"mesh":0}]})"}) {
        const std::string error = gltf_error(text);
        EXPECT_TRUE(error.starts_with("scene.gltf: ")) << error;
    }
}

}  // namespace
}  // namespace mray
