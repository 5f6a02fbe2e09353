// A clip whose keyframes are read when frames need them.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "scenes/clip.h"
#include "scenes/clip_options.h"
#include "scenes/keyframes/first_mesh.h"
#include "scenes/keyframes/keyframe_source.h"

namespace mray {

/// The parts of a clip besides its keyframes.
struct ClipParts {
    /// As Clip::name().
    std::string name;
    /// The triangles. Its faces are not used.
    FirstMesh first;
    /// Whether first.positions are those of keyframe 0.
    bool has_first_keyframe = false;
    /// Whether a frame without a keyframe repeats the frame before it; otherwise it is
    /// interpolated.
    bool holds = false;
};

/// Positions between keyframes are interpolated component by component
/// (scenes/interpolate.h); at a keyframe they equal the file's bit for bit. Memory holds the
/// keyframes that KeyframeCache keeps.
///
/// Opening reads the first keyframe. Any other one is read when a frame needs it, and one that
/// cannot be used, or has another topology, makes positions() of that frame throw Error(kBadInput).
std::unique_ptr<Clip> stream_keyframes(ClipParts parts, std::unique_ptr<KeyframeSource> source,
                                       const ClipOptions& options);

}  // namespace mray
