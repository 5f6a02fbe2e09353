// A clip whose frames are OBJ files.
#pragma once

#include <memory>
#include <span>
#include <string>

#include "common/scene/clip.h"
#include "common/scene/formats/sequence/keyframe_files.h"
#include "common/scene/scene_source.h"

namespace mray {

/// Reads all files (at least one) in parallel and keeps their positions. Positions between
/// keyframes are interpolated component by component (common/scene/interpolate.h); at a keyframe
/// they equal the file's bit for bit. If options.missing is kHold, a missing frame repeats the
/// frame before it; otherwise it is interpolated.
///
/// Triangles, colours and textures come from the first file; all files must have its faces. A later
/// file that cannot be read or, unless lenient, has coordinates that are not finite or beyond 1e30
/// does not fail the opening: damage() tells of it, the bounds exclude it, and positions() of every
/// frame that needs it throws Error(kBadInput) with the file, the line and the frame.
///
/// Throws Error: kBadInput for a first file that cannot be read and for files with other faces,
/// with the frame and the difference; kLimit if memory cannot hold the keyframes.
std::unique_ptr<Clip> open_keyframes(const std::vector<KeyframeFile>& files,
                                     const std::string& name, const SceneOptions& options);

}  // namespace mray
