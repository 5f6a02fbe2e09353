#include "app/farm/frame_tasks.h"

#include <fmt/format.h>

#include <set>

#include "app/clip/frames.h"
#include "app/farm/part.h"
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
    const FarmOptions& farm = options.farm;
    const Shard shard = farm.shard.value_or(Shard{});
    std::vector<FrameTask> tasks;
    const Block block = block_of(frames.size(), shard);
    for (std::size_t i = block.begin; i < block.end; ++i)
        tasks.push_back({frames[i], image_name(options, frames[i], digits), false});
    for (const std::size_t i : checked_frames(frames.size(), shard, farm.verify_every))
        tasks.push_back({frames[i],
                         check_folder_name(shard) + '/' + image_name(options, frames[i], digits),
                         true});
    return tasks;
}

bool has_hits_folder(const Options& options) { return options.hits.ends_with('/'); }

void make_folders(const Options& options, const std::filesystem::path& folder,
                  const std::vector<FrameTask>& tasks) {
    if (has_hits_folder(options)) make_output_folder(options.hits);
    // Checks come last.
    if (!tasks.empty() && tasks.back().is_check)
        make_output_folder((folder / tasks.back().file).parent_path());
}

std::filesystem::path exr_file_of(const Options& options, const std::filesystem::path& folder,
                                  const FrameTask& task) {
    if (options.shading.exr.empty() || task.is_check) return {};
    return (folder / task.file).replace_extension(".exr");
}

std::filesystem::path hits_file_of(const Options& options, const FrameTask& task) {
    if (!has_hits_folder(options) || task.is_check) return {};
    return (std::filesystem::path(options.hits) / task.file).replace_extension(".hits");
}

std::size_t sheet_step(std::size_t frames) {
    constexpr std::size_t kMostImages = 64;
    return (frames + kMostImages - 1) / kMostImages;
}

std::uint32_t thumbnail_width(std::size_t frames) {
    if (frames <= 4) return 768;
    return frames <= 16 ? 384 : 192;
}

}  // namespace mray::app
