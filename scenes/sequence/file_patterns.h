// The files of a sequence, by the numbers in their names.
#pragma once

#include <filesystem>

#include "scenes/animation.h"

namespace mray {

/// Whether the name ends with .obj or .ply, in letters of either case.
bool has_mesh_name(const std::filesystem::path& path);

/// Frames are whole numbers and increase.
struct KeyframeFile {
    double frame = 0;
    std::filesystem::path path;
};

/// The mesh files of a folder with names of this prefix and suffix, which differ in their last
/// number alone and are ordered by it. The first is frame 0; the greatest common divisor of the
/// differences is one frame. Throws Error(kBadInput), for missing files unless
/// options.skip_missing, which warns.
std::vector<KeyframeFile> files_of_folder(const std::filesystem::path& folder,
                                          const AnimationOptions& options,
                                          const std::string& prefix = {},
                                          const std::string& suffix = {});

/// The files that match a path with one %d, %0Nd (N from 1 to 9) or *, which stands for the frame's
/// number. If * is a number in no name, it is any text, as in files_of_folder(). Throws Error:
/// kBadArgument for a bad pattern, kBadInput.
std::vector<KeyframeFile> files_of_pattern(const std::string& pattern,
                                           const AnimationOptions& options);

}  // namespace mray
