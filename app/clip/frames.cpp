#include "app/clip/frames.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "app/terminal/progress.h"
#include "common/base/errors.h"
#include "common/scene/mesh.h"
#include "common/text/message_text.h"
#include "common/text/number_text.h"
#include "scenes/frame_range.h"
#include "scenes/inside_view.h"

namespace mray::app {
namespace {

std::vector<double> whole_frames(const Clip& clip) {
    std::vector<double> frames;
    const double first = std::ceil(clip.first_frame());
    if (clip.last_frame() - first >= static_cast<double>(kMaxFrames)) {
        throw Error(ErrorKind::kBadArgument,
                    fmt::format("--frames: the scene has {} to {}, more than a million; give some",
                                clip.first_frame(), clip.last_frame()));
    }
    const auto steps = static_cast<long long>(std::floor(clip.last_frame() - first));
    for (long long i = 0; i <= steps; ++i) frames.push_back(first + static_cast<double>(i));
    if (frames.empty()) frames.push_back(clip.first_frame());
    return frames;
}

std::vector<double> few_of(const std::vector<double>& all) {
    constexpr std::size_t kFew = 4;
    if (all.size() <= kFew) return all;
    const std::size_t last = all.size() - 1;
    // The middle and a quarter, where some parts have moved and others have not.
    return {all.front(), all[last / 4], all[last / 2], all.back()};
}

/// Frames from the seconds of --time.
std::vector<double> frames_of_time(const Options& options, const Clip& clip) {
    const std::optional<double> fps = clip.fps() ? clip.fps() : options.fps;
    if (!fps) {
        throw Error(ErrorKind::kBadArgument,
                    "--time: the scene has frames, but no seconds; give --fps, too");
    }
    // Seconds are decimal numbers, so that whole frames are missed by their rounding.
    constexpr double kRounding = 1e-6;
    std::vector<double> frames = parse_frame_range(options.time, 1 / *fps, "seconds");
    for (double& frame : frames) {
        const double seconds = frame;
        frame *= *fps;
        if (std::abs(frame - std::round(frame)) < kRounding) frame = std::round(frame);
        if (frame >= clip.first_frame() && frame <= clip.last_frame()) continue;
        throw Error(ErrorKind::kBadArgument,
                    fmt::format("--time: {} s is not in the scene, which has {} to {} s", seconds,
                                clip.first_frame() / *fps, clip.last_frame() / *fps));
    }
    return frames;
}

void require_tree_frame(const Options& options, const Clip& clip) {
    if (options.tree.build_at) require_in_clip("--build-at", *options.tree.build_at, clip);
}

/// How many digits a frame has behind the point, at most 6.
std::size_t fraction_digits(double frame) {
    const std::string text = fmt::format("{:.6f}", frame);
    return text.find_last_not_of('0') - text.find('.');
}

}  // namespace

std::unique_ptr<Clip> open_clip(const Options& options, const Messages& messages) {
    ClipOptions scene_options;
    scene_options.lenient = options.lenient;
    scene_options.allow_empty = options.allow_empty;
    scene_options.missing = options.missing;
    scene_options.cache = options.cache;
    scene_options.animation = options.animation;
    scene_options.list_animations = options.command == Command::kInfo;
    scene_options.fps = options.fps;
    scene_options.warn = [&messages](const Warning& warning) { messages.warn(warning); };
    const Progress progress("reading " + shown(std::filesystem::path(options.scene).filename()), "",
                            0, progress_mode(options));
    return open_scene(options.scene, scene_options);
}

SceneFrames open_frames(const Options& options, const Messages& messages) {
    return SceneFrames(open_clip(options, messages));
}

ImageParams image_params(const Options& options, const SceneFrames& scene) {
    return scene.image_params(with_inside_view(options.view, scene.clip()));
}

std::vector<double> select_frames(const Options& options, const Clip& clip,
                                  DefaultFrames otherwise) {
    require_tree_frame(options, clip);
    if (options.frames == "all") return whole_frames(clip);
    if (!options.time.empty()) return frames_of_time(options, clip);
    if (options.frames.empty()) {
        if (otherwise == DefaultFrames::kFirst) return {clip.first_frame()};
        std::vector<double> all = whole_frames(clip);
        return otherwise == DefaultFrames::kFew ? few_of(all) : all;
    }
    std::vector<double> frames = parse_frame_range(options.frames);
    for (const double frame : {frames.front(), frames.back()})
        require_in_clip("--frames", frame, clip);
    return frames;
}

double select_frame(const Options& options, const Clip& clip) {
    require_tree_frame(options, clip);
    if (!options.time.empty()) return frames_of_time(options, clip).front();
    const double frame = options.frame_given ? options.frame : clip.first_frame();
    require_in_clip("--frame", frame, clip);
    return frame;
}

void require_in_clip(const char* option, double frame, const Clip& clip) {
    if (frame >= clip.first_frame() && frame <= clip.last_frame()) return;
    throw Error(ErrorKind::kBadArgument,
                fmt::format("{}: frame {} is not in the scene, which has {} to {}", option, frame,
                            clip.first_frame(), clip.last_frame()));
}

FrameDigits digits_of(std::span<const double> frames, const Clip& clip) {
    FrameDigits digits;
    const std::string last = fmt::format("{:.0f}", std::floor(std::abs(clip.last_frame())));
    digits.whole = std::max(digits.whole, last.size());
    for (const double frame : frames)
        digits.fraction = std::max(digits.fraction, fraction_digits(frame));
    return digits;
}

std::string frame_label(double frame, const FrameDigits& digits) {
    const std::size_t point = digits.fraction > 0 ? 1 : 0;
    return fmt::format("{:0{}.{}f}", frame, digits.whole + point + digits.fraction,
                       digits.fraction);
}

}  // namespace mray::app
