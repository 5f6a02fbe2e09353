// The viewer: window, engine and state.
#pragma once

#include <optional>
#include <string>

#include "app/view/difference_image.h"
#include "app/view/strips.h"
#include "app/view/view_state.h"
#include "app/view/viewed_scene.h"
#include "app/view/window/canvas.h"
#include "app/view/window/input.h"
#include "app/view/window/overlay.h"
#include "app/view/window/panel.h"
#include "app/view/window/window.h"

namespace mray::app {

/// Shows the state, and lets input change it. Image and window are apart: the engine traces the
/// next image while this one is drawn, and no call waits for it.
class Viewer {
public:
    /// The options are those of with_render_defaults(); `messages` must outlive it. Opens the
    /// scene before the window. Throws Error.
    Viewer(const Options& options, const Messages& messages);

    /// Returns when the window is closed, or at what the options say. Throws Error.
    void run();
    /// Describes what it has shown, for people.
    std::string summary() const;

private:
    struct Layout {
        ScreenRect canvas;
        ScreenRect panel;
        ScreenRect timeline;
    };
    Layout layout() const;
    bool step();
    void follow_input(const Layout& layout, double now);
    void move_on(double now);
    void post(double now);
    std::uint32_t most_samples() const;
    bool take_image();
    void take_pixel();
    void show(const TracedImage& image);
    void draw(const Layout& layout);
    void draw_image(const Layout& layout) const;
    void draw_notes(ScreenRect canvas) const;
    void draw_over(ScreenRect canvas);
    void act(const PanelActions& actions);
    void act(const InputActions& actions);
    void ask_pixel(Pixel pixel);
    PanelFacts facts(double now) const;
    bool difference_is_shown() const {
        return difference_ && state_.comparison == Comparison::kDifference;
    }
    bool moves() const { return state_.playback.playing; }
    std::string activity() const;
    void save(const std::string& file);
    void save_next();
    void copy();

    const Options& options() const { return scene_->options; }
    const Clip& clip() const { return *scene_->clip; }

    const Messages& messages_;
    std::unique_ptr<ViewedScene> scene_;
    ViewState state_;
    Camera first_camera_;
    Window window_;
    ImageTexture first_;
    ImageTexture second_;
    Input input_;
    Strips strips_;
    std::string message_;
    std::optional<PixelProbe> pixel_;
    bool shows_keys_ = false;
    bool vsync_ = true;
    /// activity() at the last look.
    std::string shown_activity_;

    /// The image on the screen, and what is drawn over it.
    std::unique_ptr<TracedImage> image_;
    Comparison shown_comparison_ = Comparison::kOff;
    std::optional<DifferenceImage> difference_;
    std::vector<ImageLine> lines_;

    /// The request in progress or answered last, its step, and whether it is answered.
    ImageRequest posted_;
    int step_ = -1;
    bool is_answered_ = false;
    /// The first request of the state, by which a change is noticed.
    ImageRequest first_request_;
    double changed_at_ = 0;
    double last_ = 0;
    int redraws_ = 3;
    bool is_done_ = false;
    bool has_saved_ = false;

    RateMeter images_;
    RateMeter rays_;
    /// Sums of what was shown, for summary().
    struct Totals {
        std::uint64_t images = 0;
        double update_ms = 0;
        double deform_ms = 0;
        double trace_ms = 0;
        double shade_ms = 0;
        double began = 0;
        double ended = 0;
        std::uint64_t early_bytes = 0;
    };
    Totals totals_;
};

}  // namespace mray::app
