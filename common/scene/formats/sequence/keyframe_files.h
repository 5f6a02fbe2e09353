// The files of a sequence.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "common/scene/scene_source.h"

namespace morphray {

/// Frames are whole numbers and increase.
struct KeyframeFile {
    double frame = 0;
    std::filesystem::path path;
};

/// The .obj files of a folder (not of folders in it; hidden files do not count), by the last number
/// in their names, which must be alike apart from it. The first is frame 0; the greatest common
/// step between the numbers is one frame. Throws Error(kBadInput) for a folder without .obj files,
/// names that differ, a number twice, and, if options.missing is kFail, a step without a file,
/// naming it. Otherwise warns of those.
std::vector<KeyframeFile> files_of_folder(const std::filesystem::path& folder,
                                          const SceneOptions& options);

/// The files that match a pattern (FramePattern), from the first number to the last; frames are the
/// numbers in the names. Throws Error: kBadArgument for a bad pattern, kBadInput for no file, and
/// for missing ones as above.
std::vector<KeyframeFile> files_of_pattern(const std::string& pattern, const SceneOptions& options);

}  // namespace morphray
