// A clip whose triangles are those of a mesh file and whose positions are those of a point cache.
#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include "scenes/clip.h"
#include "scenes/clip_options.h"

namespace mray {

/// Frames are those of the samples, each of which is a keyframe
/// (scenes/sequence/streamed_clip.h). A sample with coordinates that are not finite
/// or beyond 1e30 cannot be used; if options.lenient, such coordinates are kept, with a warning.
///
/// Throws Error(kBadInput) for files that cannot be read, and for another number of points than the
/// mesh has vertices.
std::unique_ptr<Clip> open_cached(const std::filesystem::path& mesh,
                                  const std::filesystem::path& cache, const std::string& name,
                                  const ClipOptions& options);

}  // namespace mray
