// The panel at the right of the window: what is shown, and figures.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "app/view/image_request.h"
#include "app/view/view_state.h"
#include "app/view/window/window.h"

namespace mray::app {

/// Figures and texts to show. The image may be null.
struct PanelFacts {
    const TracedImage* image = nullptr;
    /// Whether images follow each other without input, or the first one is waited for.
    bool moves = false;
    /// Images a second on the screen.
    double presented_rate = 0;
    /// Millions of rays a second while tracing, and with everything that is between.
    double traced_mrays = 0;
    double presented_mrays = 0;
    /// Pixels that differ, of a comparison.
    std::optional<std::uint64_t> different;
    std::string pixel;
    std::string message;
    /// Whether the copied command gives the bits of the image.
    bool is_reproducible = true;
    bool vsync = true;
};

/// The buttons that were pressed.
struct PanelActions {
    bool screenshot = false;
    bool copy_command = false;
    bool copy_probe = false;
    bool close_pixel = false;
    bool reset_camera = false;
    bool light_here = false;
    bool switch_vsync = false;
};

PanelActions draw_panel(const ScreenRect& rect, ViewState& state, const PanelFacts& facts);

}  // namespace mray::app
