// A clip whose frames are mesh files.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "scenes/clip.h"
#include "scenes/clip_options.h"
#include "scenes/sequence/keyframe_files.h"

namespace mray {

/// Each file (at least one) is a keyframe (scenes/sequence/streamed_clip.h). If
/// options.missing is kHold, a missing frame repeats the frame before it; otherwise it is
/// interpolated.
///
/// Triangles, colours and textures come from the first file; all files must have its faces. A later
/// file that cannot be read or, unless lenient, has coordinates that are not finite or beyond 1e30
/// does not fail the opening: it is a keyframe that cannot be used.
///
/// Throws Error(kBadInput) for a first file that cannot be read and for files with other faces,
/// with the frame and the difference.
std::unique_ptr<Clip> open_keyframes(const std::vector<KeyframeFile>& files,
                                     const std::string& name, const ClipOptions& options);

}  // namespace mray
