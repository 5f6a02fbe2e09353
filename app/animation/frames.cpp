#include "app/animation/frames.h"

#include "scenes/gltf/gltf_animation.h"
#include "scenes/sequence/file_patterns.h"

namespace mray::app {
namespace {

// A + n * STEP of decimal numbers such as 0..0.3:0.1 misses B by a few units in the last place.
constexpr double kHitTolerance = 1e-9;

std::vector<double> whole_frames(const Animation& animation) {
    std::vector<double> frames;
    const double first = std::ceil(animation.first_frame());
    if (animation.last_frame() - first >= static_cast<double>(kMaxFrames))
        throw Error(ErrorKind::kBadArgument,
                    "--frames: the scene has {} to {}, more than a million; give some",
                    animation.first_frame(), animation.last_frame());
    const auto steps = static_cast<long long>(std::floor(animation.last_frame() - first));
    for (long long i = 0; i <= steps; ++i) frames.push_back(first + static_cast<double>(i));
    if (frames.empty()) frames.push_back(animation.first_frame());
    return frames;
}

void require_in_animation(const char* option, double frame, const Animation& animation) {
    if (frame >= animation.first_frame() && frame <= animation.last_frame()) return;
    throw Error(ErrorKind::kBadArgument, "{}: frame {} is not in the scene, which has {} to {}",
                option, frame, animation.first_frame(), animation.last_frame());
}

}  // namespace

std::vector<double> parse_frame_range(const std::string& text) {
    const auto fail = [&text](const std::string& what) {
        throw Error(ErrorKind::kBadArgument,
                    "frames {}: {}; write A, A..B or A..B:STEP, such as 0..20:0.5, or several of "
                    "them with commas, such as 0,7,20",
                    quote(text), what);
    };
    const auto number = [&fail](std::string_view digits) {
        const std::optional<double> value = parse_double(digits);
        if (!value || !std::isfinite(*value)) fail("not finite decimal numbers");
        return *value;
    };
    std::vector<double> frames;
    for (const std::string_view range : split(text, ',')) {
        const std::size_t dots = range.find("..");
        const double first = number(range.substr(0, dots));
        if (!frames.empty() && !(first > frames.back()))
            fail(
                fmt::format("{} does not come after {}; they must increase", first, frames.back()));
        double last = first;
        double step = 1;
        if (dots != std::string_view::npos) {
            const std::string_view rest = range.substr(dots + 2);
            const std::size_t colon = rest.find(':');
            last = number(rest.substr(0, colon));
            if (colon != std::string_view::npos) step = number(rest.substr(colon + 1));
        }
        if (last < first) fail("the last frame is before the first");
        if (!(step > 0)) fail("the step is not above 0");
        const double steps = (last - first) / step;
        // Also when the quotient overflows.
        if (!(steps < static_cast<double>(kMaxFrames - frames.size())))
            fail("more than a million frames");

        const std::size_t count = static_cast<std::size_t>(steps + kHitTolerance) + 1;
        for (std::size_t i = 0; i < count; ++i)
            frames.push_back(first + static_cast<double>(i) * step);
        if (std::abs(frames.back() - last) <= kHitTolerance * step) frames.back() = last;
    }
    return frames;
}

std::unique_ptr<Animation> open_animation(const SourceOptions& source, const Messages& messages) {
    if (source.fps && !has_gltf_name(source.scene))
        throw Error(ErrorKind::kBadArgument, "--fps: only glTF files have seconds; leave it out");
    AnimationOptions options = source;
    options.warn = [&](const Warning& warning) { messages.warn(warning); };
    const Progress progress("reading " + escape(std::filesystem::path(source.scene).filename()), 0,
                            messages);
    return open_scene(source.scene, options);
}

std::vector<double> select_frames(const Options& options, const Animation& animation,
                                  DefaultFrames otherwise) {
    if (options.tree.build_at)
        require_in_animation("--build-at", *options.tree.build_at, animation);
    if (options.frames == "all") return whole_frames(animation);
    if (options.frames.empty()) {
        std::vector<double> all = whole_frames(animation);
        constexpr std::size_t kFew = 4;
        if (otherwise == DefaultFrames::kAll || all.size() <= kFew) return all;
        const std::size_t last = all.size() - 1;
        // The middle and a quarter, where some parts have moved and others have not.
        return {all.front(), all[last / 4], all[last / 2], all.back()};
    }
    std::vector<double> selected = parse_frame_range(options.frames);
    for (const double frame : {selected.front(), selected.back()})
        require_in_animation("--frames", frame, animation);
    return selected;
}

double select_frame(const Options& options, const Animation& animation) {
    if (options.tree.build_at)
        require_in_animation("--build-at", *options.tree.build_at, animation);
    if (options.frame) require_in_animation("--frame", *options.frame, animation);
    return options.frame.value_or(animation.first_frame());
}

std::vector<std::string> frame_labels(std::span<const double> frames, const Animation& animation) {
    constexpr std::size_t kLeastDigits = 4;
    const std::string last = fmt::format("{:.0f}", std::floor(std::abs(animation.last_frame())));
    std::size_t fraction = 0;
    for (const double frame : frames) {
        const std::string text = fmt::format("{:.6f}", frame);
        fraction = std::max(fraction, text.find_last_not_of('0') - text.find('.'));
    }
    const std::size_t width =
        std::max(kLeastDigits, last.size()) + (fraction > 0 ? fraction + 1 : 0);
    std::vector<std::string> labels;
    for (const double frame : frames)
        labels.push_back(fmt::format("{:0{}.{}f}", frame, width, fraction));
    return labels;
}

}  // namespace mray::app
