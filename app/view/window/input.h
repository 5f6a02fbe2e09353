// Mouse and keys on the image.
#pragma once

#include <optional>
#include <span>

#include "app/view/engine.h"
#include "app/view/view_state.h"
#include "app/view/window/window.h"

namespace mray::app {

/// The actions that input asks for beyond the state.
struct InputActions {
    /// A pixel of the canvas that was clicked on.
    std::optional<Pixel> clicked;
    bool screenshot = false;
    bool copy_command = false;
    bool reset_camera = false;
    bool switch_keys = false;
    /// Whether what is over the image is to be closed.
    bool escapes = false;
    bool quits = false;
};

/// Turns the input of Dear ImGui's current frame into movements of the camera and of time.
class Input {
public:
    /// `canvas` is where the image is. Sizes of movements are parts of the canvas's height.
    InputActions apply(const ScreenRect& canvas, float pixel_scale, std::span<const KeyPress> keys,
                       ViewState& state);
    /// Whether a button is held or a key moves the camera.
    bool is_active() const { return drag_ != Drag::kNone || flies_; }

private:
    enum class Drag { kNone, kOrbit, kPan, kWipe };
    void begin_drag(const ScreenRect& canvas, ViewState& state);
    void drag(const ScreenRect& canvas, ViewState& state);
    void fly(ViewState& state);
    void press(int key, ViewState& state, InputActions& actions);

    Drag drag_ = Drag::kNone;
    bool flies_ = false;
    /// Whether the pointer has moved since the button was pressed.
    bool has_moved_ = false;
};

}  // namespace mray::app
