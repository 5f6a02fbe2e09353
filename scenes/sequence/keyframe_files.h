// The files of a sequence.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "scenes/clip_options.h"

namespace mray {

/// Frames are whole numbers and increase.
struct KeyframeFile {
    double frame = 0;
    std::filesystem::path path;
};

/// The mesh files of a folder, without those in its folders and hidden ones, ordered by the last
/// number in their names, which must be equal apart from it. The first is frame 0; the greatest
/// common divisor of the differences is one frame. Throws Error(kBadInput) for a folder without
/// mesh files, for files of several formats, names that differ, a number twice, and, if
/// options.missing is kFail, a missing file, which it names; otherwise warns of missing files.
std::vector<KeyframeFile> files_of_folder(const std::filesystem::path& folder,
                                          const ClipOptions& options);

/// The files that match a path with one %d, %0Nd (N from 1 to 9) or * in its file name, where * is
/// a number of any width and %% a percent sign; frames are the numbers in the names. The text never
/// reaches printf. Throws Error: kBadArgument for a bad pattern, kBadInput if no file matches, and
/// for missing files as above.
std::vector<KeyframeFile> files_of_pattern(const std::string& pattern, const ClipOptions& options);

}  // namespace mray
