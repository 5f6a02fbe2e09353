// Motion by keyframes.
#pragma once

#include <cmath>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "common/scene/pose.h"
#include "common/scene/scene_keyframes.h"
#include "common/scene/scene_space.h"
#include "tests/gpu/test_scenes.h"
#include "tests/support/listed_clip.h"

namespace morphray::test {

/// A clip with its poses, made on the host or left to whoever can do with keyframes.
class KeyframeScene {
public:
    KeyframeScene(Topology topology, std::vector<std::vector<vec3>> keyframes)
        : clip_(std::move(topology), std::move(keyframes)),
          space_(clip_.bounds()),
          keyframes_(clip_, space_),
          positions_(clip_.topology().vertex_count) {}
    KeyframeScene(const KeyframeScene&) = delete;
    KeyframeScene& operator=(const KeyframeScene&) = delete;

    const Topology& topology() const { return clip_.topology(); }
    std::span<const vec3> positions(double frame) {
        ++made_count_;
        clip_.positions(frame, positions_);
        space_.to_scene(positions_, positions_);
        return positions_;
    }
    Pose pose(double frame) {
        return {{&keyframes_, *keyframes_.blend(frame)},
                [this, frame] { return positions(frame); }};
    }
    /// How often positions have been made.
    int made_count() const { return made_count_; }

private:
    ListedClip clip_;
    SceneSpace space_;
    SceneKeyframes keyframes_;
    std::vector<vec3> positions_;
    int made_count_ = 0;
};

inline constexpr int kKeyframes = 6;

/// The poses that a scene's motion has at six times. Off to one side scene space is centred.
inline std::unique_ptr<KeyframeScene> swaying(const TestScene& scene, float off = 0) {
    std::vector<std::vector<vec3>> keyframes;
    for (int k = 0; k < kKeyframes; ++k) {
        keyframes.push_back(swayed(scene, static_cast<float>(k)));
        for (vec3& p : keyframes.back()) {
            p = p.x > kSceneExtent ? vec3(std::nanf("")) : p * 0x1p-16f + vec3(off);
        }
    }
    return std::make_unique<KeyframeScene>(scene.topology, keyframes);
}

}  // namespace morphray::test
