// The positions of a clip with keyframes, straight in scene space.
#pragma once

#include <optional>
#include <span>

#include "common/scene/clip.h"
#include "common/scene/scene_space.h"

namespace mray {

/// Interpolates keyframes in units of scene space, in one pass instead of those of
/// Clip::positions() and SceneSpace::to_scene(). The bits are the same (derivation in
/// scene_keyframes.cpp).
class SceneKeyframes {
public:
    /// The clip must outlive it.
    SceneKeyframes(const Clip& clip, const SceneSpace& space);

    /// The place of a frame between keyframes. Nothing if positions() cannot give the bits: for
    /// clips without keyframes, for frames that cannot be used, and for scenes whose extent is
    /// 2^-31 or less or whose coordinates, in either space, go beyond 2^126.
    std::optional<KeyframeBlend> blend(double frame) const;
    /// Writes the positions of a blend, in scene space.
    void positions(const KeyframeBlend& blend, std::span<vec3> out) const;

private:
    const Clip& clip_;
    float scale_ = 1;
    /// The centre of scene space, in its units.
    vec3 centre_ = {0, 0, 0};
    bool is_usable_ = false;
};

}  // namespace mray
