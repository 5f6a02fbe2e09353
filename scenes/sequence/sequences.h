// Clips of several files, and of a mesh file with a point cache.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "scenes/clip.h"

namespace mray {

/// Frames are whole numbers and increase.
struct KeyframeFile {
    double frame = 0;
    std::filesystem::path path;
};

/// The mesh files of a folder, without those in its folders and hidden ones, ordered by the last
/// number in their names, which must be equal apart from it. The first is frame 0; the greatest
/// common divisor of the differences is one frame. Throws Error(kBadInput) for a folder without
/// mesh files, for names that differ, a number twice, and, if options.missing is kFail, a missing
/// file, which it names; otherwise warns of missing files.
std::vector<KeyframeFile> files_of_folder(const std::filesystem::path& folder,
                                          const ClipOptions& options);

/// The files that match a path with one %d, %0Nd (N from 1 to 9) or * in its file name, where * is
/// a number of any width and %% a percent sign; frames are the numbers in the names. The text never
/// reaches printf. Throws Error: kBadArgument for a bad pattern, kBadInput if no file matches, and
/// for missing files as above.
std::vector<KeyframeFile> files_of_pattern(const std::string& pattern, const ClipOptions& options);

/// Each file (at least one) is a keyframe (scenes/sequence/streamed_clip.h). If
/// options.missing is kHold, a missing frame repeats the frame before it; otherwise it is
/// interpolated.
///
/// Triangles, colours and textures come from the first file; all files must have its faces. A later
/// file that cannot be read or, unless lenient, has coordinates that are not finite or beyond 1e30
/// does not fail the opening: it is a keyframe that cannot be used.
///
/// Throws Error(kBadInput) for a first file that cannot be read and for files with other faces,
/// with the frame.
std::unique_ptr<Clip> open_keyframes(const std::vector<KeyframeFile>& files,
                                     const std::string& name, const ClipOptions& options);

/// The triangles of a mesh file with the positions of a point cache, each sample of which is a
/// keyframe. A sample with coordinates that are not finite or beyond 1e30 cannot be used; if
/// options.lenient, such coordinates are kept, with a warning.
///
/// Throws Error(kBadInput) for files that cannot be read, and for another number of points than the
/// mesh has vertices.
std::unique_ptr<Clip> open_cached(const std::filesystem::path& mesh,
                                  const std::filesystem::path& cache, const std::string& name,
                                  const ClipOptions& options);

}  // namespace mray
