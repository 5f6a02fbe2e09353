// How a clip is opened.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>

#include "common/base/errors.h"
#include "scenes/mesh/mesh_file.h"

namespace mray {

enum class MissingFrames { kFail, kHold, kSkip };

struct ClipOptions {
    /// Accept vertices that are not finite and leave out faces that cannot be read, with a warning
    /// each, instead of refusing the scene.
    bool lenient = false;
    /// Accept a scene without faces.
    bool allow_empty = false;
    MissingFrames missing = MissingFrames::kFail;
    /// A PC2 or MDD file with the positions of a mesh file's vertices; empty: none.
    std::string cache = {};
    /// The animation of a glTF file, by its name or its index; empty: the first.
    std::string animation = {};
    /// Whether Clip::animations() are wanted. One that cannot be read is then a warning.
    bool list_animations = false;
    /// The frames that an animation of a glTF file has a second, above 0; nothing: kDefaultFps.
    std::optional<double> fps = {};
    /// Is told the size of a glTF scene before it takes memory, and throws Error(kLimit) if it is
    /// too large.
    std::function<void(std::uint64_t triangles, std::uint64_t vertices)> check_size = {};
    WarnFunction warn = {};
};

}  // namespace mray
