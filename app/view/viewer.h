// The viewer: window, engine and state.
#pragma once

#include "app/base/options.h"
#include "app/terminal/messages.h"

namespace mray::app {

/// Opens the scene, then a window. Returns when the window is closed, or after the screenshot that
/// the options ask for. Throws Error.
void show_scene(const ViewOptions& options, const Messages& messages);

}  // namespace mray::app
