// Opens scenes by name.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "common/base/warning.h"
#include "common/scene/clip.h"

namespace mray {

enum class MissingFrames { kFail, kHold, kSkip };

struct SceneOptions {
    /// Accept, with a warning each, vertices that are not finite and scenes without faces, and
    /// leave out faces that cannot be read, instead of refusing the scene.
    bool lenient = false;
    /// Accept a scene without faces.
    bool allow_empty = false;
    MissingFrames missing = MissingFrames::kFail;
    /// A PC2 or MDD file with the positions of an .obj file's vertices; empty: none.
    std::string cache = {};
    /// The animation of a glTF file, by its name or its index; empty: the first.
    std::string animation = {};
    /// The frames that an animation of a glTF file has a second, above 0; nothing: kDefaultFps.
    std::optional<double> fps = {};
    /// Is told the size of a glTF scene before it takes memory, and throws Error(kLimit) if it is
    /// too large.
    std::function<void(std::uint64_t triangles, std::uint64_t vertices)> check_size = {};
    WarnFunction warn = {};
};

/// Opens `builtin:NAME[:TRIANGLES]`, an .obj, .gltf or .glb file, a folder of .obj files, or a
/// pattern such as `frame_%04d.obj`. Throws Error: kBadArgument (unknown builtin, bad pattern, a
/// cache for anything but one .obj file, an animation for anything but a glTF file that has it),
/// kBadInput, kLimit.
std::unique_ptr<Clip> open_scene(const std::string& spec, const SceneOptions& options = {});

}  // namespace mray
