// Texts over the image: what is waited for, what colours mean, a pixel, the keys, a scene to open.
#pragma once

#include <array>
#include <optional>
#include <string>

#include "app/view/legend.h"
#include "app/view/window/window.h"

namespace mray::app {

/// Says in the upper left corner of the image what is waited for, if that is not empty.
void draw_activity(const ScreenRect& canvas, const std::string& activity);

/// Shows in the lower left corner of the image what its colours mean, and returns how much of the
/// image's height it takes. Nothing without colours.
float draw_legend(const ScreenRect& canvas, const Legend& legend);

/// Marks a place of the image, in screen coordinates.
void draw_marker(float x, float y);
/// Writes a text beside a place of the image, within `canvas` if it fits there.
void draw_note(const ScreenRect& canvas, float x, float y, const std::string& note);

/// A message over the image, such as why a scene cannot be opened.
struct Notice {
    std::string text;
    bool is_error = false;
};
/// Shows it in the upper left corner of the image, below the activity. Returns whether its button
/// to close it was pressed.
bool draw_notice(const ScreenRect& canvas, const Notice& notice);

/// The name of a scene that is typed.
class SceneField {
public:
    /// Begins to ask for a name; the one before stays to be changed.
    void show();
    void hide() { is_shown_ = false; }
    bool is_shown() const { return is_shown_; }
    /// Whether it is to be drawn until it takes what is typed, which needs some frames.
    bool wants_focus() const { return is_shown_ && wants_focus_; }
    /// Draws the field in the middle of the image. Returns the name when it is complete, and hides.
    std::optional<std::string> draw(const ScreenRect& canvas);

private:
    std::array<char, 4096> name_ = {};
    bool is_shown_ = false;
    bool wants_focus_ = false;
};

/// Lists mouse and keys in the middle of the image. Returns whether its button to close it was
/// pressed.
bool draw_keys(const ScreenRect& canvas);

}  // namespace mray::app
