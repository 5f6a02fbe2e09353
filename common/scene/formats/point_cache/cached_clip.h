// A clip whose triangles are those of a mesh file and whose positions are those of a point cache.
#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include "common/scene/clip.h"
#include "common/scene/scene_source.h"

namespace mray {

/// Frames are those of the samples; in between positions are interpolated as those of OBJ files
/// (common/scene/interpolate.h), at a sample they equal the file's bit for bit. All samples are
/// read once, for the bounds, and again when a frame needs them, so that memory holds a few of them
/// at a time whatever their number.
///
/// A sample with coordinates that are not finite or beyond 1e30 does not fail the opening, unless
/// it is the only one: damage() tells of it, the bounds exclude it, and positions() of every frame
/// that needs it throws Error(kBadInput) with the file, the frame and the vertex. If
/// options.lenient, such coordinates are kept, with a warning.
///
/// Throws Error(kBadInput) for files that cannot be read, and for another number of points than the
/// mesh has vertices.
std::unique_ptr<Clip> open_cached(const std::filesystem::path& mesh,
                                  const std::filesystem::path& cache, const std::string& name,
                                  const SceneOptions& options);

}  // namespace mray
