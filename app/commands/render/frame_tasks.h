// The images that a render writes, and their names.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "app/base/options.h"
#include "app/clip/frames.h"

namespace mray::app {

/// An image that is to be rendered.
struct FrameTask {
    double frame = 0;
    /// The name of its PNG file in the output folder.
    std::string file;
};

/// The folder that --out means; of one image its folder.
std::filesystem::path output_folder_of(const Options& options);

/// Throws Error(kBadArgument) if two frames would have one file.
void require_distinct_names(const Options& options, const std::vector<double>& frames,
                            const FrameDigits& digits);

/// The images of these frames.
std::vector<FrameTask> frame_tasks(const Options& options, const std::vector<double>& frames,
                                   const FrameDigits& digits);

/// Whether --hits names a folder, in which each frame has a file.
bool has_hits_folder(const Options& options);

/// Return the OpenEXR file of a task, and its file of hits if --hits names a folder. Empty: none.
std::filesystem::path exr_file_of(const Options& options, const std::filesystem::path& folder,
                                  const FrameTask& task);
std::filesystem::path hits_file_of(const Options& options, const FrameTask& task);

}  // namespace mray::app
