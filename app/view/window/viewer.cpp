#include "app/view/window/viewer.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <utility>

#include "app/base/process_memory.h"
#include "app/clip/render_command.h"
#include "app/terminal/interrupt.h"
#include "app/terminal/progress.h"
#include "app/view/copy_command.h"
#include "app/view/legend.h"
#include "app/view/pixel_text.h"
#include "app/view/window/style.h"
#include "app/view/window/timeline.h"
#include "common/base/output_file.h"
#include "common/image/png.h"
#include "common/text/message_text.h"

namespace mray::app {
namespace {

constexpr int kPanelWidth = 330;
constexpr int kTimelineHeight = 150;
/// The time without a change after which an image is refined.
constexpr double kStillSeconds = 0.12;
/// Between two looks at the clock while something moves, and while nothing does. Images and input
/// end the wait.
constexpr double kActiveSeconds = 0.002;
constexpr double kIdleSeconds = 0.1;
/// Dear ImGui needs some frames after input until all of it shows.
constexpr int kRedraws = 3;
/// The image by which everything has been allocated that stays.
constexpr std::uint64_t kEarlyImage = 100;

std::string title_of(const Clip& clip) { return "morphray view " + shown(clip.name()); }

const TracedPane* pane_of(const TracedImage* image, std::size_t i) {
    return image != nullptr && i < image->panes.size() ? &image->panes[i] : nullptr;
}

}  // namespace

Viewer::Viewer(const Options& options, const Messages& messages)
    : messages_(messages),
      scene_(open_viewed_scene(options, messages, [] { Window::wake(); })),
      state_(scene_->first_state),
      first_camera_(state_.camera),
      window_(title_of(clip()), static_cast<int>(state_.width) + kPanelWidth,
              static_cast<int>(state_.height) + kTimelineHeight) {
    window_.set_vsync(vsync_);
}

Viewer::Layout Viewer::layout() const {
    const float width = std::max(window_.width() - kPanelWidth, 1.0f);
    const float height = std::max(window_.height() - kTimelineHeight, 1.0f);
    return {{0, 0, width, height},
            {width, 0, kPanelWidth, window_.height()},
            {0, height, width, kTimelineHeight}};
}

void Viewer::run() {
    totals_.began = last_ = Window::seconds();
    while (step()) throw_if_interrupted();
}

/// Returns whether to go on.
bool Viewer::step() {
    const bool is_active = moves() || redraws_ > 0 || input_.is_active() ||
                           (is_answered_ && step_ < last_step(state_));
    window_.wait(is_active ? kActiveSeconds : kIdleSeconds);
    if (window_.closes()) return false;
    if (window_.take_input()) redraws_ = kRedraws;
    const double now = Window::seconds();
    const bool is_new = take_image();
    const std::string doing = activity();
    if (doing != shown_activity_) redraws_ = std::max(redraws_, 1);
    shown_activity_ = doing;
    take_pixel();
    if (is_new || redraws_ > 0) {
        window_.begin_frame();
        const Layout places = layout();
        follow_input(places, now);
        // The next image is traced while this one is drawn.
        post(now);
        if (image_ && (is_new || shown_comparison_ != state_.comparison)) show(*image_);
        draw(places);
        if (redraws_ > 0) --redraws_;
        if (is_new) {
            totals_.ended = Window::seconds();
            images_.add(totals_.ended);
            if (image_ && !image_->panes.empty()) {
                double rays = 0;
                for (const TracedPane& pane : image_->panes) rays += static_cast<double>(pane.rays);
                rays_.add(totals_.ended, rays);
            }
        }
    } else {
        move_on(now);
        post(now);
    }
    return !is_done_ && (options().exit_after == 0 || totals_.images < options().exit_after);
}

void Viewer::follow_input(const Layout& places, double now) {
    act(input_.apply(places.canvas, window_.pixel_scale(), window_.take_keys(), state_));
    move_on(now);
    if (!options().screenshot.empty() && totals_.images == 0) return;
    state_.width = static_cast<std::uint32_t>(
        std::max(std::lround(places.canvas.width * window_.pixel_scale()), 1L));
    state_.height = static_cast<std::uint32_t>(
        std::max(std::lround(places.canvas.height * window_.pixel_scale()), 1L));
}

/// Lets time pass.
void Viewer::move_on(double now) { state_.playback.advance(now - std::exchange(last_, now)); }

/// Asks for the first image of a state that has changed, and for a better one when it is still.
void Viewer::post(double now) {
    // With --exit only the complete image is wanted.
    const int first = options().exits ? last_step(state_) : 0;
    const ImageRequest fresh = request_of(state_, first);
    if (step_ < 0 || fresh != first_request_) {
        first_request_ = fresh;
        posted_ = fresh;
        step_ = first;
        changed_at_ = now;
        is_answered_ = false;
        scene_->engine.post(posted_);
        return;
    }
    const bool is_still = now - changed_at_ >= kStillSeconds && !state_.playback.playing;
    if (!is_answered_ || !is_still || step_ >= last_step(state_)) return;
    ImageRequest better = request_of(state_, step_ + 1);
    if (better.samples > most_samples()) return;
    ++step_;
    posted_ = std::move(better);
    is_answered_ = false;
    scene_->engine.post(posted_);
}

/// The most samples a pixel that memory suffices for.
std::uint32_t Viewer::most_samples() const {
    return affordable_samples(posted_.view.width, posted_.view.height, free_memory_bytes() / 2);
}

bool Viewer::take_image() {
    std::unique_ptr<TracedImage> image = scene_->engine.take();
    if (!image) return false;
    if (image->request == posted_) is_answered_ = true;
    image_ = std::move(image);
    if (!image_->error.empty()) return true;
    strips_.add(*image_);
    const TracedPane& pane = image_->panes.front();
    ++totals_.images;
    totals_.update_ms += pane.update_ms;
    totals_.deform_ms += pane.deform_ms;
    totals_.trace_ms += pane.trace_ms;
    totals_.shade_ms += pane.shade_ms;
    if (totals_.images == kEarlyImage) totals_.early_bytes = resident_memory_bytes();
    const bool is_complete = is_answered_ && step_ >= last_step(state_);
    if (!options().screenshot.empty() && !has_saved_ && is_complete) {
        save(options().screenshot);
        has_saved_ = true;
        is_done_ = options().exits;
    }
    return true;
}

void Viewer::take_pixel() {
    std::optional<PixelProbe> probe = scene_->engine.take_probe();
    if (!probe) return;
    redraws_ = kRedraws;
    pixel_ = std::move(probe);
}

/// Makes the image the one that is drawn.
void Viewer::show(const TracedImage& image) {
    shown_comparison_ = state_.comparison;
    difference_.reset();
    lines_.clear();
    if (image.panes.empty()) return;
    const TracedPane& pane = image.panes[0];
    if (image.panes.size() > 1) difference_ = difference_of(pane, image.panes[1]);
    if (difference_is_shown()) {
        first_.upload(difference_->width, difference_->height, difference_->pixels);
    } else {
        first_.upload(pane.width, pane.height, pane.pixels);
        if (image.panes.size() > 1)
            second_.upload(image.panes[1].width, image.panes[1].height, image.panes[1].pixels);
    }
    lines_ = box_lines(image.request.view, image.boxes);
}

void Viewer::draw(const Layout& places) {
    draw_timeline(places.timeline, state_, strips_);
    draw_over(places.canvas);
    act(draw_panel(places.panel, state_, facts(Window::seconds())));
    window_.end_frame([&] { draw_image(places); });
}

void Viewer::draw_over(ScreenRect canvas) {
    draw_activity(canvas, activity());
    if (shows_keys_) {
        shows_keys_ = !draw_keys(canvas);
    } else {
        draw_notes(canvas);
    }
}

/// Says what colours mean; marks the pixel that was clicked on, and says what it shows, until the
/// image is another one.
void Viewer::draw_notes(ScreenRect canvas) const {
    const ScreenRect whole = canvas;
    if (image_ && !image_->panes.empty() && !difference_is_shown()) {
        const ImageRequest& shown = image_->request;
        canvas.height -= draw_legend(
            canvas, legend_of(shown.shading, depth_range(*shown.view.eye, clip().bounds())));
    }
    if (!pixel_ || pixel_->request.image != first_request_) return;
    const ProbeRequest& request = pixel_->request;
    const bool is_beside = state_.comparison == Comparison::kSide;
    ScreenRect pane = whole;
    if (is_beside) pane.width /= 2;
    const float x = pane.x + pane.width * (static_cast<float>(request.pixel.x) + 0.5f) /
                                 static_cast<float>(request.image.view.width);
    const float y = pane.y + pane.height * (static_cast<float>(request.pixel.y) + 0.5f) /
                                 static_cast<float>(request.image.view.height);
    draw_marker(x, y);
    if (is_beside) draw_marker(x + pane.width, y);
    draw_note(canvas, x, y, pixel_note(*pixel_));
}

void Viewer::draw_image(const Layout& places) const {
    const Painter painter(window_.pixel_scale(), window_.height());
    const auto [red, green, blue] = kPanelBackground;
    painter.fill(places.panel, red, green, blue);
    painter.fill(places.timeline, red, green, blue);
    const ScreenRect& canvas = places.canvas;
    const std::size_t count = image_ ? image_->panes.size() : 0;
    if (count == 0) {
        painter.fill(canvas, 0.06f, 0.065f, 0.07f);
    } else if (count == 1 || state_.comparison == Comparison::kDifference) {
        first_.draw(canvas);
        painter.lines(lines_, canvas);
    } else if (state_.comparison == Comparison::kWipe) {
        first_.draw(canvas, 0, state_.wipe);
        second_.draw(canvas, state_.wipe, 1);
        painter.lines(lines_, canvas);
        painter.fill({canvas.x + state_.wipe * canvas.width - 1, canvas.y, 2, canvas.height}, 1, 1,
                     1);
    } else {
        ScreenRect half = canvas;
        half.width = canvas.width / 2;
        first_.draw(half);
        painter.lines(lines_, half);
        half.x += half.width;
        second_.draw(half);
        painter.lines(lines_, half);
        painter.fill({half.x - 1, canvas.y, 2, canvas.height}, 1, 1, 1);
    }
}

/// The work that is to be waited for; empty if there is none.
std::string Viewer::activity() const {
    const bool builds = scene_->engine.builds();
    if (image_ && !builds) return {};
    const std::string text = builds ? building_text(clip()) : "tracing the first image";
    const float part = step_done().load();
    return part > 0 ? fmt::format("{}: {:.0f} %", text, 100 * std::min(part, 1.0f)) : text;
}

PanelFacts Viewer::facts(double now) const {
    PanelFacts facts;
    facts.image = image_.get();
    facts.moves = moves() || !image_;
    facts.presented_rate = facts.moves ? images_.slow_rate(now) : images_.rate(now);
    facts.presented_mrays = (facts.moves ? rays_.slow_rate(now) : rays_.rate(now)) / 1e6;
    if (const TracedPane* pane = pane_of(image_.get(), 0)) {
        const double ms = pane->trace_ms + pane->shade_ms;
        facts.traced_mrays = ms > 0 ? static_cast<double>(pane->rays) / ms / 1e3 : 0;
        facts.is_reproducible = is_reproducible(image_->request, pane->tree);
    }
    if (difference_) facts.different = difference_->different;
    if (pixel_) facts.pixel = pixel_text(*pixel_);
    facts.message = message_;
    facts.vsync = vsync_;
    return facts;
}

void Viewer::act(const PanelActions& actions) {
    if (actions.screenshot) save_next();
    if (actions.copy_command) copy();
    if (actions.copy_probe && pixel_) {
        const ProbeRequest& request = pixel_->request;
        window_.copy_to_clipboard(probe_command(options(), request.image, request.pixel));
        message_ = "the probe command is in the clipboard";
    }
    if (actions.close_pixel) pixel_.reset();
    if (actions.reset_camera) state_.camera = first_camera_;
    if (actions.light_here) state_.light = light_at_camera(state_, clip());
    if (actions.switch_vsync) {
        vsync_ = !vsync_;
        window_.set_vsync(vsync_);
    }
}

void Viewer::act(const InputActions& actions) {
    if (actions.clicked) ask_pixel(*actions.clicked);
    if (actions.screenshot) save_next();
    if (actions.copy_command) copy();
    if (actions.reset_camera) state_.camera = first_camera_;
    if (actions.switch_keys) shows_keys_ = !shows_keys_;
    if (actions.escapes) shows_keys_ = false;
    if (actions.quits) is_done_ = true;
}

void Viewer::ask_pixel(Pixel pixel) {
    const ImageRequest request = request_of(state_, 0);
    pixel.x %= request.view.width;
    pixel.y = std::min(pixel.y, request.view.height - 1);
    scene_->engine.probe({request, pixel});
}

/// Writes the first backend's image, or the difference, as it is shown.
void Viewer::save(const std::string& file) {
    const TracedPane* const pane = pane_of(image_.get(), 0);
    if (pane == nullptr) return;
    const ImageRequest& request = image_->request;
    if (difference_is_shown()) {
        const Image image{difference_->width, difference_->height, difference_->pixels};
        write_file(file, encode_png(image));
        return;
    }
    const Image image{pane->width, pane->height, pane->pixels};
    write_file(file, encode_png(image, pixel_texts(render_options(options(), request, pane->tree),
                                                   request.frame, image.pixels)));
}

/// Writes to the first free name in the current folder.
void Viewer::save_next() {
    if (!image_ || image_->panes.empty()) return;
    std::string file;
    for (int i = 1; file.empty() || std::filesystem::exists(file); ++i)
        file = fmt::format("morphray_{:04}.png", i);
    try {
        save(file);
        message_ = fmt::format("written: {}", file);
    } catch (const Error& error) {
        message_ = error.what();
    }
}

void Viewer::copy() {
    const TracedPane* const pane = pane_of(image_.get(), 0);
    if (pane == nullptr) return;
    const std::string command = copy_command(options(), image_->request, pane->tree);
    window_.copy_to_clipboard(command);
    // The clipboard of X11 ends with the program.
    messages_.print(command + "\n");
    message_ = "the command is in the clipboard";
}

std::string Viewer::summary() const {
    const auto count = static_cast<double>(std::max<std::uint64_t>(totals_.images, 1));
    const double seconds = totals_.ended - totals_.began;
    constexpr double kMiB = 1024.0 * 1024.0;
    std::string text = fmt::format(
        "{} images in {:.2f} s: {:.1f} images/s\ndeform {:.2f} ms, update {:.2f} ms, trace {:.2f} "
        "ms, shade {:.2f} ms (means)\n",
        totals_.images, seconds, seconds > 0 ? count / seconds : 0, totals_.deform_ms / count,
        totals_.update_ms / count, totals_.trace_ms / count, totals_.shade_ms / count);
    if (totals_.early_bytes == 0) return text;
    return text + fmt::format("resident memory {:.1f} MiB at image {}, {:.1f} MiB at the end\n",
                              static_cast<double>(totals_.early_bytes) / kMiB, kEarlyImage,
                              static_cast<double>(resident_memory_bytes()) / kMiB);
}

}  // namespace mray::app
