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

/// The files that match a pattern (FramePattern), from the first number to the last; frames are the
/// numbers in the names. Throws Error: kBadArgument for a bad pattern, kBadInput if no file
/// matches, and for missing files as above.
std::vector<KeyframeFile> files_of_pattern(const std::string& pattern, const ClipOptions& options);

/// The same for a pattern with one * in the file name, for numbers of any width: what shells leave
/// alone in quotes. Throws Error(kBadArgument) for more, and for a * in a folder's name.
std::vector<KeyframeFile> files_of_glob(const std::string& glob, const ClipOptions& options);

}  // namespace mray
