// Where the keyframes of a clip are read from.
#pragma once

#include <cstddef>
#include <optional>
#include <span>

#include "common/base/warning.h"
#include "common/interop/platform.h"

namespace mray {

/// One file for each keyframe, or one file for all. Threads may share one.
class KeyframeSource {
public:
    virtual ~KeyframeSource() = default;

    virtual std::size_t count() const = 0;
    /// The frame of a keyframe; frames increase.
    virtual double frame(std::size_t keyframe) const = 0;

    /// Reads the positions of a keyframe, in world space, into `out`, which has an entry for each
    /// vertex. Returns a warning about them. Throws Error(kBadInput) for a keyframe that cannot be
    /// used, with its file and frame.
    virtual std::optional<Warning> read(std::size_t keyframe, std::span<vec3> out) const = 0;
};

}  // namespace mray
