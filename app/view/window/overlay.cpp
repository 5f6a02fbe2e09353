#include "app/view/window/overlay.h"

#include <imgui.h>

#include <algorithm>
#include <utility>

#include "app/view/window/style.h"

namespace mray::app {
namespace {

constexpr ImGuiWindowFlags kOverlay = ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_NoMove |
                                      ImGuiWindowFlags_NoSavedSettings |
                                      ImGuiWindowFlags_NoFocusOnAppearing;
constexpr ImGuiWindowFlags kOverlayText = kOverlay | ImGuiWindowFlags_NoInputs |
                                          ImGuiWindowFlags_AlwaysAutoResize |
                                          ImGuiWindowFlags_NoBringToFrontOnFocus;
constexpr ImU32 kOverlayColour = IM_COL32(15, 17, 18, 235);
constexpr float kMargin = 8;

/// Inputs and what they do, as in docs/guide/options.md.
constexpr std::pair<const char*, const char*> kInputs[] = {
    {"drag", "orbit"},
    {"shift-drag", "pan"},
    {"wheel", "zoom"},
    {"W A S D, Q E", "fly; down and up"},
    {"click", "show the pixel"},
    {"space", "play, pause"},
    {"left, right", "a frame back, on"},
    {"Home, End", "the first, last frame"},
    {"1 to 7", "shading"},
    {"V", "CPU or Vulkan"},
    {"M", "compare the backends"},
    {"B", "boxes of the tree"},
    {"R", "the first camera"},
    {"P", "save a screenshot"},
    {"C", "copy the command"},
    {"H, F1", "these keys"},
    {"ctrl-Q", "quit"},
};

/// Begins a window over the image; the colour is popped by end_overlay().
void begin_overlay(const char* name, ImGuiWindowFlags flags) {
    ImGui::PushStyleColor(ImGuiCol_WindowBg, kOverlayColour);
    ImGui::Begin(name, nullptr, flags);
}

void end_overlay() {
    ImGui::End();
    ImGui::PopStyleColor();
}

}  // namespace

void draw_activity(const ScreenRect& canvas, const std::string& activity) {
    if (activity.empty()) return;
    ImGui::SetNextWindowPos({canvas.x, canvas.y});
    begin_overlay("activity", kOverlayText);
    ImGui::TextUnformatted(activity.c_str());
    end_overlay();
}

float draw_legend(const ScreenRect& canvas, const Legend& legend) {
    if (legend.colours.empty()) return 0;
    ImGui::SetNextWindowPos({canvas.x + kMargin, canvas.y + canvas.height - kMargin}, 0, {0, 1});
    begin_overlay("legend", kOverlayText);
    ImGui::TextUnformatted(legend.title.c_str());
    ImDrawList& list = *ImGui::GetWindowDrawList();
    const float font = ImGui::GetFontSize();
    const float width = std::max(ImGui::CalcTextSize(legend.title.c_str()).x, 14 * font);
    const ImVec2 at = ImGui::GetCursorScreenPos();
    const float step = width / static_cast<float>(legend.colours.size());
    for (std::size_t i = 0; i < legend.colours.size(); ++i) {
        const float x = at.x + step * static_cast<float>(i);
        list.AddRectFilled({x, at.y}, {x + step + 0.5f, at.y + font}, legend.colours[i]);
    }
    for (const Legend::Tick& tick : legend.ticks) {
        const float x = at.x + tick.place * width;
        // Texts at the ends stay within the bar.
        const float text = ImGui::CalcTextSize(tick.text.c_str()).x;
        list.AddLine({x, at.y + font}, {x, at.y + font + 3}, 0xFFE8E8E8u);
        list.AddText({x - tick.place * text, at.y + font + 4}, 0xFFE8E8E8u, tick.text.c_str());
    }
    ImGui::Dummy({width, 2 * font + 4});
    const float height = ImGui::GetWindowHeight() + kMargin;
    end_overlay();
    return height;
}

void draw_marker(float x, float y) {
    ImDrawList& list = *ImGui::GetBackgroundDrawList();
    list.AddRect({x - 4, y - 4}, {x + 5, y + 5}, 0xFF000000u);
    list.AddRect({x - 3, y - 3}, {x + 4, y + 4}, 0xFFFFFFFFu);
}

void draw_note(const ScreenRect& canvas, float x, float y, const std::string& note) {
    const ImVec2 text = ImGui::CalcTextSize(note.c_str());
    const ImVec2 padding = ImGui::GetStyle().WindowPadding;
    const ImVec2 size = {text.x + 2 * padding.x, text.y + 2 * padding.y};
    const float right = canvas.x + canvas.width - size.x;
    const float bottom = canvas.y + canvas.height - size.y;
    // Right of the place, or left of it where there is no room.
    const float left = x + kMargin <= right ? x + kMargin : x - kMargin - size.x;
    ImGui::SetNextWindowPos({std::max(std::min(left, right), canvas.x),
                             std::max(std::min(y + kMargin, bottom), canvas.y)});
    begin_overlay("pixel note", kOverlayText);
    ImGui::TextUnformatted(note.c_str());
    end_overlay();
}

bool draw_keys(const ScreenRect& canvas) {
    const float line = ImGui::GetTextLineHeightWithSpacing();
    const float wanted = line * (static_cast<float>(std::size(kInputs)) + 3);
    const float height = std::min(wanted, canvas.height);
    const float width = std::min(21 * ImGui::GetFontSize(), canvas.width);
    ImGui::SetNextWindowPos(
        {canvas.x + (canvas.width - width) / 2, canvas.y + (canvas.height - height) / 2});
    ImGui::SetNextWindowSize({width, height});
    // It scrolls where the image is smaller.
    begin_overlay("keys", kOverlay & ~ImGuiWindowFlags_NoScrollbar);
    for (const auto& [input, does] : kInputs) {
        ImGui::TextUnformatted(input);
        ImGui::SameLine(8 * ImGui::GetFontSize());
        ImGui::TextUnformatted(does);
    }
    const bool closes = ImGui::Button("close");
    end_overlay();
    return closes;
}

}  // namespace mray::app
