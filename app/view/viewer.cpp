#include <fmt/format.h>
#include <imgui.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <utility>

#include "app/animation/frames.h"
#include "app/terminal/failure.h"
#include "app/view/controls.h"
#include "common/base/output_file.h"
#include "common/image/png.h"
#include "common/text/text.h"

namespace mray::app {
namespace {

constexpr int kPanelWidth = 330;
/// The time without a change after which an image is refined.
constexpr double kStillSeconds = 0.12;
/// Between two looks at the clock; images and input end the wait.
constexpr double kIdleSeconds = 0.1;
/// Samples of an image that is refined by itself: they take 1.6 GB.
constexpr std::uint64_t kMostSamples = std::uint64_t{1} << 25;

std::uint32_t pixels_of(float length, float scale) {
    return static_cast<std::uint32_t>(std::max(std::lround(length * scale), 1L));
}

/// The engine traces the next image while this one is drawn, and no call waits for it.
class Viewer {
public:
    Viewer(const ViewOptions& options, const Messages& messages)
        : options_(options),
          animation_(open_animation(options_.image.source, messages)),
          state_(initial_state(
              options_, *animation_,
              select_frame(options_.frame, options_.image.tree.build_at, *animation_))),
          first_camera_(state_.camera),
          window_("morphray view " + escape(animation_->name()),
                  static_cast<int>(state_.view.width) + kPanelWidth,
                  static_cast<int>(state_.view.height)),
          engine_(options_.image, *animation_, messages, [] { Window::wake(); }) {
        if (!options_.screenshot.empty()) return;
        // The screen may be smaller than the window that was asked for.
        take_size(options_.image.view);
        const double frame = state_.playback.frame();
        state_ = initial_state(options_, *animation_, frame);
        first_camera_ = state_.camera;
    }

    void run() {
        last_ = Window::seconds();
        while (step()) throw_if_interrupted();
    }

private:
    float panel_width() const { return state_.shows_panel ? kPanelWidth : 0; }
    float image_width() const { return std::max(window_.width() - panel_width(), 1.0f); }

    bool step() {
        window_.wait(kIdleSeconds);
        if (window_.closes()) return false;
        const bool is_new = take_image();
        if (is_done_) return false;
        if (std::optional<PixelProbe> probe = engine_.take_probe()) pixel_ = std::move(probe);
        window_.begin_frame();
        const float height = window_.height();
        const InputActions actions =
            apply_input(height, window_.take_keys(), first_camera_, state_);
        const double now = Window::seconds();
        state_.playback.advance(now - std::exchange(last_, now));
        // A screenshot has the size of the options.
        if (options_.screenshot.empty()) {
            take_size(state_.view);
            const float scale = window_.pixel_scale();
            if (actions.clicked) {
                const auto [x, y] = *actions.clicked;
                const Pixel pixel = {std::min(pixels_of(x, scale), state_.view.width) - 1,
                                     std::min(pixels_of(y, scale), state_.view.height) - 1};
                engine_.probe({request_of(state_, 0), pixel});
            }
        }
        // The next image is traced while this one is drawn.
        post(now);
        if (is_new && !image_->panes.empty()) {
            const TracedPane& pane = image_->panes.front();
            std::vector<std::uint32_t> shown = pane.pixels;
            different_.reset();
            if (image_->panes.size() > 1) {
                DifferenceImage difference = difference_of(pane, image_->panes[1]);
                different_ = difference.different;
                shown = std::move(difference.pixels);
            }
            window_.set_image(pane.width, pane.height, shown,
                              box_lines(image_->request.view, image_->boxes));
        }
        draw();
        return !actions.quits;
    }

    void take_size(morphray::View& view) const {
        view.width = pixels_of(image_width(), window_.pixel_scale());
        view.height = pixels_of(window_.height(), window_.pixel_scale());
    }

    /// Asks for the first image of a state that has changed, and for a better one when it is still.
    void post(double now) {
        // A screenshot shows the complete image, so coarser ones are left out.
        const int first = options_.screenshot.empty() ? 0 : last_step(state_);
        ImageRequest fresh = request_of(state_, first);
        if (step_ < 0 || fresh != first_request_) {
            first_request_ = std::move(fresh);
            posted_ = first_request_;
            step_ = first;
            changed_at_ = now;
        } else {
            const bool is_still = now - changed_at_ >= kStillSeconds && !state_.playback.playing;
            if (!is_answered_ || !is_still || step_ >= last_step(state_)) return;
            ImageRequest better = request_of(state_, step_ + 1);
            const std::uint64_t pixels = std::uint64_t{better.view.width} * better.view.height;
            if (better.view.samples > 1 && pixels * better.view.samples > kMostSamples) return;
            ++step_;
            posted_ = std::move(better);
        }
        is_answered_ = false;
        engine_.post(posted_);
    }

    bool take_image() {
        std::unique_ptr<TracedImage> image = engine_.take();
        if (!image) return false;
        if (image->request == posted_) is_answered_ = true;
        message_ = image->error;
        image_ = std::move(image);
        if (!options_.screenshot.empty() && is_answered_ && !image_->panes.empty()) {
            const TracedPane& pane = image_->panes.front();
            write_file(options_.screenshot,
                       encode_png(Image{pane.width, pane.height, pane.pixels}));
            is_done_ = true;
        }
        return true;
    }

    void draw_label() const {
        const std::string text =
            fmt::format("difference of CPU and Vulkan: {} pixels differ (white)", *different_);
        const ImVec2 size = ImGui::CalcTextSize(text.c_str());
        ImDrawList& list = *ImGui::GetBackgroundDrawList();
        list.AddRectFilled({4, 4}, {12 + size.x, 12 + size.y}, 0xFF404040u);
        list.AddText({8, 8}, 0xFFFFFFFFu, text.c_str());
    }

    void draw() {
        const float width = image_width();
        PanelFacts facts{.image = image_.get(), .pixel = {}, .message = message_};
        if (!image_) {
            facts.message = fmt::format("building the tree, {} triangles",
                                        animation_->topology().triangles.size());
        }
        // The pixel that was clicked on is shown until the image is another one.
        if (pixel_ && pixel_->request.image == first_request_) {
            facts.pixel = pixel_text(*pixel_);
            const float scale = window_.pixel_scale();
            const float x = (static_cast<float>(pixel_->request.pixel.x) + 0.5f) / scale;
            const float y = (static_cast<float>(pixel_->request.pixel.y) + 0.5f) / scale;
            ImDrawList& list = *ImGui::GetBackgroundDrawList();
            list.AddRect({x - 4, y - 4}, {x + 5, y + 5}, 0xFF000000u);
            list.AddRect({x - 3, y - 3}, {x + 4, y + 4}, 0xFFFFFFFFu);
        }
        if (different_) draw_label();
        if (state_.shows_panel) draw_panel(width, panel_width(), window_.height(), state_, facts);
        window_.end_frame(width);
    }

    ViewOptions options_;
    std::unique_ptr<Animation> animation_;
    ViewState state_;
    Camera first_camera_;
    Window window_;
    Engine engine_;
    bool is_done_ = false;

    std::unique_ptr<TracedImage> image_;
    std::optional<std::uint64_t> different_;
    std::optional<PixelProbe> pixel_;
    std::string message_;

    /// The request in progress or answered last, its step, and whether it is answered.
    ImageRequest posted_;
    int step_ = -1;
    bool is_answered_ = false;
    /// The first request of the state, by which a change is noticed.
    ImageRequest first_request_;
    double changed_at_ = 0;
    double last_ = 0;
};

}  // namespace

void show_scene(const ViewOptions& options, const Messages& messages) {
    Viewer(options, messages).run();
}

}  // namespace mray::app
