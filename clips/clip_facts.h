// Facts of a clip that are known once each of its keyframes has been read.
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

#include "common/scene/world_bounds.h"

namespace mray {

/// A box of floats, as bounds_of() finds; empty: lower > upper.
struct KeyframeBounds {
    float lower[3] = {1, 1, 1};
    float upper[3] = {-1, -1, -1};

    KeyframeBounds() = default;
    explicit KeyframeBounds(const WorldBounds& bounds) {
        for (int axis = 0; axis < 3; ++axis) {
            lower[axis] = static_cast<float>(bounds.lower[axis]);
            upper[axis] = static_cast<float>(bounds.upper[axis]);
        }
    }
    WorldBounds world() const {
        return {{lower[0], lower[1], lower[2]}, {upper[0], upper[1], upper[2]}};
    }
    bool operator==(const KeyframeBounds&) const = default;
};

struct ClipFacts {
    /// One for each keyframe; empty for one that cannot be used.
    std::vector<KeyframeBounds> bounds;
    /// Keyframes that cannot be used, ascending.
    std::vector<std::size_t> damaged;
    /// Keyframes with a warning, ascending.
    std::vector<std::size_t> odd;

    bool is_damaged(std::size_t keyframe) const {
        return std::binary_search(damaged.begin(), damaged.end(), keyframe);
    }
    /// The bounds of all keyframes.
    WorldBounds all() const {
        WorldBounds all;
        for (const KeyframeBounds& keyframe : bounds) {
            const WorldBounds world = keyframe.world();
            if (!world.empty()) all.extend(world.lower, world.upper);
        }
        return all;
    }
};

}  // namespace mray
