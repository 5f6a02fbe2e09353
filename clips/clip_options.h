// How a clip is opened.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>

#include "clips/mesh/file_mesh.h"
#include "common/base/warning.h"
#include "common/base/watch.h"
#include "common/scene/world_bounds.h"

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
    /// Formats of meshes beyond mesh_formats().
    std::span<const MeshFormat> more_formats = {};
    /// Whether what is known of a whole clip may come from an index file.
    bool takes_index = true;
    /// The index file; empty: the default one (clips/index/index_file.h), if there
    /// is one.
    std::string index = {};
    /// The bounds of all frames of a clip from files. Keyframes are then not read, and poses of a
    /// glTF file not evaluated, to find them; a frame that leaves them is an error when it is
    /// needed.
    std::optional<WorldBounds> bounds = {};
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
    /// Is asked, and told, while all keyframes are read.
    Watch watch = {};
};

}  // namespace mray
