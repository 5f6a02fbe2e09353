// The bar below the image: time, and strips of measurements.
#pragma once

#include "app/view/strips.h"
#include "app/view/view_state.h"
#include "app/view/window/window.h"

namespace mray::app {

void draw_timeline(const ScreenRect& rect, ViewState& state, const Strips& strips);

}  // namespace mray::app
