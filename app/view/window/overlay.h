// Texts over the image: what is waited for, what colours mean, a pixel, the keys.
#pragma once

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

/// Lists mouse and keys in the middle of the image. Returns whether its button to close it was
/// pressed.
bool draw_keys(const ScreenRect& canvas);

}  // namespace mray::app
