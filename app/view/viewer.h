// The viewer: window, engine and state.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "app/view/engine.h"
#include "app/view/state.h"
#include "app/view/window.h"

namespace mray::app {

/// Shows the state, and lets input change it. Image and window are apart: the engine traces the
/// next image while this one is drawn, and no call waits for it.
class Viewer {
public:
    /// `messages` must outlive it. Opens the
    /// scene before the window. Throws Error.
    Viewer(const ViewOptions& options, const Messages& messages);

    /// Returns when the window is closed, or after the screenshot that the options ask for. Throws
    /// Error.
    void run();

private:
    bool step();
    void post(double now);
    bool take_image();
    void draw();

    ViewOptions options_;
    std::unique_ptr<Clip> clip_;
    ViewState state_;
    Camera first_camera_;
    Window window_;
    Engine engine_;
    bool is_done_ = false;

    /// The image on the screen.
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

}  // namespace mray::app
