#include "app/commands/render/frame_tasks.h"

#include <fmt/format.h>

#include <set>

#include "app/clip/frames.h"
#include "common/base/errors.h"
#include "common/base/output_file.h"

namespace mray::app {
namespace {

std::string image_name(const Options& options, double frame, const FrameDigits& digits) {
    if (renders_one_image(options)) return std::filesystem::path(options.out).filename();
    return fmt::format("frame_{}.png", frame_label(frame, digits));
}

}  // namespace

std::filesystem::path output_folder_of(const Options& options) {
    if (options.out.empty()) return "out";
    if (!renders_one_image(options)) return options.out;
    const std::filesystem::path folder = std::filesystem::path(options.out).parent_path();
    return folder.empty() ? "." : folder;
}

void require_distinct_names(const Options& options, const std::vector<double>& frames,
                            const FrameDigits& digits) {
    if (renders_one_image(options) && frames.size() > 1) {
        throw Error(
            ErrorKind::kBadArgument,
            fmt::format("--out {}: one image, but {} frames; choose one of them by --frames, "
                        "or give a folder",
                        options.out, frames.size()));
    }
    std::set<std::string> names;
    for (const double frame : frames) {
        if (names.insert(image_name(options, frame, digits)).second) continue;
        throw Error(ErrorKind::kBadArgument,
                    fmt::format("--frames: two frames would both become {}; "
                                "choose a larger step",
                                image_name(options, frame, digits)));
    }
}

std::vector<FrameTask> frame_tasks(const Options& options, const std::vector<double>& frames,
                                   const FrameDigits& digits) {
    std::vector<FrameTask> tasks;
    for (const double frame : frames) tasks.push_back({frame, image_name(options, frame, digits)});
    return tasks;
}

bool has_hits_folder(const Options& options) { return options.hits.ends_with('/'); }

std::filesystem::path exr_file_of(const Options& options, const std::filesystem::path& folder,
                                  const FrameTask& task) {
    if (options.shading.exr.empty()) return {};
    return (folder / task.file).replace_extension(".exr");
}

std::filesystem::path hits_file_of(const Options& options, const FrameTask& task) {
    if (!has_hits_folder(options)) return {};
    return (std::filesystem::path(options.hits) / task.file).replace_extension(".hits");
}

}  // namespace mray::app
