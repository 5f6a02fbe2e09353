// Where the keyframes of a clip are read from.
#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <span>

#include "common/base/errors.h"
#include "common/base/warning.h"
#include "common/interop/platform.h"

namespace mray {

/// Findings about a keyframe that was read, besides its positions.
struct KeyframeNotes {
    /// Why the keyframe cannot be used; nothing if it can.
    std::optional<Error> problem = {};
    std::optional<Warning> warning = {};
};

/// One file for each keyframe, or one file for all. Threads may share one.
class KeyframeSource {
public:
    virtual ~KeyframeSource() = default;

    virtual std::size_t count() const = 0;
    /// The frame of a keyframe; frames increase.
    virtual double frame(std::size_t keyframe) const = 0;
    /// The file that a keyframe is read from.
    virtual const std::filesystem::path& file(std::size_t keyframe) const = 0;

    /// Reads the positions of a keyframe, in world space, into `out`, which has an entry for each
    /// vertex; they are of no use if there is a problem. Throws Error(kBadInput) for a keyframe
    /// with another topology, with which the clip is none.
    virtual KeyframeNotes read(std::size_t keyframe, std::span<vec3> out) const = 0;
};

}  // namespace mray
