// A pose of a scene, whose positions need not be there before somebody looks at them.
#pragma once

#include <functional>
#include <optional>
#include <span>
#include <utility>

#include "common/scene/scene_keyframes.h"

namespace morphray {

class Pose {
public:
    /// These positions, in scene space; they must outlive it.
    explicit Pose(std::span<const vec3> positions) : positions_(positions) {}
    /// The positions are what `make` gives when they are first asked for.
    Pose(const KeyframePose& keyframes, std::function<std::span<const vec3>()> make)
        : keyframes_(keyframes), make_(std::move(make)) {}

    std::size_t vertex_count() const {
        return keyframes_ ? keyframes_->keyframes->vertex_count() : positions_.size();
    }
    /// What gives the positions on a device.
    const std::optional<KeyframePose>& keyframes() const { return keyframes_; }
    /// Throws what making them throws.
    std::span<const vec3> positions() {
        if (make_) positions_ = std::exchange(make_, nullptr)();
        return positions_;
    }

private:
    std::optional<KeyframePose> keyframes_;
    std::function<std::span<const vec3>()> make_;
    std::span<const vec3> positions_;
};

}  // namespace morphray
