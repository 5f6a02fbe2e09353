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
    /// A pixel of the canvas whose vertex is to be pulled.
    std::optional<Pixel> grabbed;
    bool screenshot = false;
    bool copy_command = false;
    bool reset_camera = false;
    bool switch_keys = false;
    /// A scene is to be chosen, and a turn to be recorded; `escapes` ends what is in progress.
    bool opens = false;
    bool records = false;
    bool escapes = false;
    bool quits = false;
};

/// Turns the input of Dear ImGui's current frame into movements of the camera, of time, and of the
/// vertex that is pulled.
class Input {
public:
    /// `canvas` is where the image is. Sizes of movements are parts of the canvas's height.
    InputActions apply(const ScreenRect& canvas, float pixel_scale, std::span<const KeyPress> keys,
                       ViewState& state);
    /// The vertex of a pixel that was grabbed, at a depth along the view in world space: it follows
    /// the pointer from where it was pressed until it is released.
    void grab(std::uint32_t vertex, double depth, float radius, ViewState& state);
    /// Whether a button is held or a key moves the camera.
    bool is_active() const { return drag_ != Drag::kNone || flies_; }

private:
    enum class Drag { kNone, kOrbit, kPan, kPull, kWipe };
    void begin_drag(const ScreenRect& canvas, ViewState& state);
    void drag(const ScreenRect& canvas, ViewState& state);
    void pull(double right, double down, ViewState& state);
    void fly(ViewState& state);
    void press(int key, ViewState& state, InputActions& actions);

    Drag drag_ = Drag::kNone;
    bool flies_ = false;
    /// Whether the pointer has moved since the button was pressed.
    bool has_moved_ = false;
    struct Grabbed {
        double depth = 0;
        std::size_t pull = 0;
    };
    std::optional<Grabbed> grabbed_;
    /// The way of the pointer before the vertex is known.
    double waiting_right_ = 0;
    double waiting_down_ = 0;
};

}  // namespace mray::app
