// glTF files of tests, opened as animations.
#pragma once

#include <gtest/gtest.h>

#include <string>

#include "tests/scenes/opened_scene.h"

namespace mray::test {

struct OpenedGltf : private TemporaryFolder, public OpenedScene {
    explicit OpenedGltf(const std::string& bytes, const AnimationOptions& options = {},
                        const char* name = "scene.gltf")
        : OpenedScene(write(name, bytes), options) {}
};

/// The message of the error for a file without its folder; empty if it opens.
inline std::string gltf_error(const std::string& bytes, const AnimationOptions& options = {},
                              const char* name = "scene.gltf") {
    const TemporaryFolder folder;
    const std::string path = folder.write(name, bytes);
    return message_without(folder, [&] { open_scene(path, options); });
}

inline void expect_point(const vec3& actual, double x, double y, double z, double most = 1e-6) {
    EXPECT_NEAR(static_cast<double>(actual.x), x, most);
    EXPECT_NEAR(static_cast<double>(actual.y), y, most);
    EXPECT_NEAR(static_cast<double>(actual.z), z, most);
}

}  // namespace mray::test
