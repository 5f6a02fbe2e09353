// glTF files of tests, opened as animations.
#pragma once

#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <vector>

#include "scenes/animation.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/thrown_error.h"

namespace mray::test {

/// An animation, its warnings and the folder with its file.
class OpenedGltf {
public:
    explicit OpenedGltf(const std::string& bytes, AnimationOptions options = {},
                        const char* name = "scene.gltf") {
        const std::string path = folder_.write(name, bytes);
        options.warn = [this](const Warning& warning) { warnings_.push_back(warning.line()); };
        animation_ = open_scene(path, options);
    }

    const Animation& animation() const { return *animation_; }
    const std::vector<std::string>& warnings() const { return warnings_; }

    std::vector<vec3> at(double frame) const {
        std::vector<vec3> positions(animation_->topology().vertex_count);
        animation_->positions(frame, positions);
        return positions;
    }

private:
    TemporaryFolder folder_;
    std::vector<std::string> warnings_;
    std::unique_ptr<Animation> animation_;
};

/// The message of the error for a file without its folder; empty if it opens.
inline std::string gltf_error(const std::string& bytes, const AnimationOptions& options = {},
                              const char* name = "scene.gltf") {
    const TemporaryFolder folder;
    const std::string path = folder.write(name, bytes);
    std::string text = message_of([&] { open_scene(path, options); });
    const std::string prefix = folder.path().native() + "/";
    for (std::size_t at = text.find(prefix); at != text.npos; at = text.find(prefix))
        text.erase(at, prefix.size());
    return text;
}

inline void expect_point(const vec3& actual, double x, double y, double z, double most = 1e-6) {
    EXPECT_NEAR(static_cast<double>(actual.x), x, most);
    EXPECT_NEAR(static_cast<double>(actual.y), y, most);
    EXPECT_NEAR(static_cast<double>(actual.z), z, most);
}

}  // namespace mray::test
