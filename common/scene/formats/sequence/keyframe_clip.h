// A clip whose frames are OBJ files.
#pragma once

#include <memory>
#include <span>
#include <string>

#include "common/scene/clip.h"
#include "common/scene/formats/sequence/keyframe_files.h"
#include "common/scene/scene_source.h"

namespace morphray {

/// Reads all files (at least one), in parallel, and keeps their positions. Between keyframes
/// positions are interpolated component by component (common/scene/interpolate.h), and at a
/// keyframe they are the file's, bit for bit. A frame that is missing is the one before if
/// options.missing is kHold; otherwise it is interpolated like any frame between two keyframes.
///
/// All files must have the faces of the first one, from which triangles and colours are taken. A
/// later file that cannot be read or, unless lenient, has coordinates that are not finite or beyond
/// 1e30, does not fail the opening: it is the clip's damage() and left out of the bounds, and
/// positions() of every frame that it takes part in throws Error(kBadInput) with the file, the line
/// and the frame.
///
/// Throws Error: kBadInput for a first file that cannot be read and for files of other faces, with
/// the frame and what differs; kLimit for more keyframes than there is memory.
std::unique_ptr<Clip> open_keyframes(const std::vector<KeyframeFile>& files,
                                     const std::string& name, const SceneOptions& options);

}  // namespace morphray
