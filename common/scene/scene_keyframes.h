// The keyframes of a clip as devices interpolate them.
#pragma once

#include <cstddef>
#include <optional>
#include <span>

#include "common/scene/clip.h"
#include "common/scene/scene_space.h"

namespace morphray {

/// Keyframes in units of scene space, not centred: between_keyframes() of them gives the bits of
/// SceneSpace::to_scene() of the clip's positions (derivation in scene_keyframes.cpp).
class SceneKeyframes {
public:
    /// The clip must outlive it.
    SceneKeyframes(const Clip& clip, const SceneSpace& space);

    /// Where a frame lies between keyframes. Nothing where it must be the clip's positions: for
    /// clips without keyframes, for frames that cannot be used, and for scenes whose extent is
    /// 2^-31 or less or whose coordinates, in either space, go beyond 2^126.
    std::optional<KeyframeBlend> blend(double frame) const;

    std::uint32_t vertex_count() const { return clip_.topology().vertex_count; }
    /// Scene space's, in the units of the keyframes.
    vec3 centre() const { return centre_; }
    /// Writes a keyframe. A vertex that is not finite becomes kNoKeyframe on all axes.
    void write(std::size_t keyframe, std::span<vec3> out) const;
    /// Writes the pose in scene space.
    void positions(const KeyframeBlend& blend, std::span<vec3> out) const;

private:
    vec3 scaled(vec3 user) const;

    const Clip& clip_;
    float scale_ = 1;
    vec3 centre_ = {0, 0, 0};
    bool is_usable_ = false;
};

/// A pose of a clip by its keyframes.
struct KeyframePose {
    const SceneKeyframes* keyframes = nullptr;
    KeyframeBlend blend;
    bool operator==(const KeyframePose&) const = default;
};

}  // namespace morphray
