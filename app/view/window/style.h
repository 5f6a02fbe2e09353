// How the viewer's panels look.
#pragma once

namespace mray::app {

/// Sets fonts and colours of Dear ImGui, whose context exists. `scale` is 1 where a pixel of the
/// window is a screen coordinate.
void set_style(float scale);

struct Colour {
    float red = 0;
    float green = 0;
    float blue = 0;
};
/// Behind panels, which have no background of their own.
inline constexpr Colour kPanelBackground = {0.105f, 0.115f, 0.13f};

/// The colours of text and strips, as Dear ImGui packs them.
inline constexpr unsigned kUpdateColour = 0xFFE0A030u;
inline constexpr unsigned kTraceColour = 0xFF60C060u;
inline constexpr unsigned kCostColour = 0xFF50A0F0u;
inline constexpr unsigned kFaintColour = 0xFF808080u;
inline constexpr unsigned kGoodColour = 0xFF80D080u;
inline constexpr unsigned kBadColour = 0xFF6060F0u;

}  // namespace mray::app
