#include "app/animation/frames.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "app/terminal/messages.h"
#include "common/base/errors.h"
#include "common/text/number_text.h"
#include "common/text/text_parts.h"
#include "scenes/gltf/gltf_animation.h"
#include "scenes/scene_frames.h"

namespace mray::app {
namespace {

std::vector<double> whole_frames(const Animation& animation) {
    std::vector<double> frames;
    const double first = std::ceil(animation.first_frame());
    if (animation.last_frame() - first >= static_cast<double>(kMaxFrames)) {
        throw Error(ErrorKind::kBadArgument,
                    fmt::format("--frames: the scene has {} to {}, more than a million; give some",
                                animation.first_frame(), animation.last_frame()));
    }
    const auto steps = static_cast<long long>(std::floor(animation.last_frame() - first));
    for (long long i = 0; i <= steps; ++i) frames.push_back(first + static_cast<double>(i));
    if (frames.empty()) frames.push_back(animation.first_frame());
    return frames;
}

std::vector<double> few_of(const std::vector<double>& all) {
    constexpr std::size_t kFew = 4;
    if (all.size() <= kFew) return all;
    const std::size_t last = all.size() - 1;
    // The middle and a quarter, where some parts have moved and others have not.
    return {all.front(), all[last / 4], all[last / 2], all.back()};
}

/// How many digits a frame has behind the point, at most 6.
std::size_t fraction_digits(double frame) {
    const std::string text = fmt::format("{:.6f}", frame);
    return text.find_last_not_of('0') - text.find('.');
}

/// Throws Error(kBadArgument) for a frame outside the animation.
void require_in_animation(const char* option, double frame, const Animation& animation) {
    if (frame >= animation.first_frame() && frame <= animation.last_frame()) return;
    throw Error(ErrorKind::kBadArgument,
                fmt::format("{}: frame {} is not in the scene, which has {} to {}", option, frame,
                            animation.first_frame(), animation.last_frame()));
}

}  // namespace

std::unique_ptr<Animation> open_animation(const SourceOptions& source, const Messages& messages) {
    if (source.fps && !has_gltf_name(source.scene))
        throw Error(ErrorKind::kBadArgument, "--fps: only glTF files have seconds; leave it out");
    AnimationOptions options;
    options.lenient = source.lenient;
    options.skip_missing = source.skip_missing;
    options.cache = source.cache;
    options.animation = source.animation;
    options.fps = source.fps;
    options.warn = [&messages](const Warning& warning) { messages.warn(warning); };
    const Progress progress("reading " + escape(std::filesystem::path(source.scene).filename()), 0,
                            messages);
    return open_scene(source.scene, options);
}

std::vector<double> select_frames(const std::string& frames, const std::optional<double>& build_at,
                                  const Animation& animation, DefaultFrames otherwise) {
    if (build_at) require_in_animation("--build-at", *build_at, animation);
    if (frames == "all") return whole_frames(animation);
    if (frames.empty()) {
        std::vector<double> all = whole_frames(animation);
        return otherwise == DefaultFrames::kFew ? few_of(all) : all;
    }
    std::vector<double> selected = parse_frame_range(frames);
    for (const double frame : {selected.front(), selected.back()})
        require_in_animation("--frames", frame, animation);
    return selected;
}

double select_frame(const std::optional<double>& frame, const std::optional<double>& build_at,
                    const Animation& animation) {
    if (build_at) require_in_animation("--build-at", *build_at, animation);
    if (frame) require_in_animation("--frame", *frame, animation);
    return frame.value_or(animation.first_frame());
}

FrameDigits digits_of(std::span<const double> frames, const Animation& animation) {
    FrameDigits digits;
    const std::string last = fmt::format("{:.0f}", std::floor(std::abs(animation.last_frame())));
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
