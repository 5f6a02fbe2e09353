// Input, the panel and the loop of the viewer.
#pragma once

#include <array>
#include <optional>
#include <span>
#include <string>

#include "app/view/engine.h"
#include "app/view/window.h"

namespace mray::app {

struct InputActions {
    /// A place on the image that was clicked on, in screen coordinates.
    std::optional<std::array<float, 2>> clicked;
    bool quits = false;
};

/// Turns input on the image into movements of camera and time, in parts of `height`.
InputActions apply_input(float height, std::span<const KeyPress> keys, const Camera& first_camera,
                         ViewState& state);

/// What the panel says besides the state. The image may be null.
struct PanelFacts {
    const TracedImage* image = nullptr;
    std::string pixel;
    std::string message;
};

void draw_panel(float left, float width, float height, ViewState& state, const PanelFacts& facts);

/// Opens a window until it is closed or its screenshot is written. Throws Error.
void show_scene(const ViewOptions& options, const Messages& messages);

}  // namespace mray::app
