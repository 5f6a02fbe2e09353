// The window of the viewer: its input, its panel and its loop.
#pragma once

#include <array>

#include "app/view/engine.h"

namespace mray::app {

struct KeyPress {
    int key = 0;
    bool with_ctrl = false;
};

struct InputActions {
    /// A place on the image that was clicked on, in screen coordinates.
    std::optional<std::array<float, 2>> clicked;
    bool quits = false;
};

/// Turns input on the image into movements of camera and time, in parts of `height`.
InputActions apply_input(float height, std::span<const KeyPress> keys, const Camera& first_camera,
                         ViewState& state);

/// Opens a window until it is closed or its screenshot is written. Throws Error.
void show_scene(const Options& options, const Messages& messages);

}  // namespace mray::app
