#include "app/view/window/style.h"

#include <imgui.h>

#include <filesystem>

namespace mray::app {
namespace {

/// Fonts of Debian that are easier to read than the one that Dear ImGui brings; the first that is
/// installed is taken.
constexpr const char* kFonts[] = {"/usr/share/fonts/truetype/dejavu/DejaVuSans.ttf",
                                  "/usr/share/fonts/truetype/liberation/LiberationSans-Regular.ttf",
                                  "/usr/share/fonts/truetype/noto/NotoSans-Regular.ttf"};
constexpr float kFontPixels = 14;

void load_font(float scale) {
    ImGuiIO& io = ImGui::GetIO();
    for (const char* file : kFonts) {
        std::error_code error;
        if (!std::filesystem::is_regular_file(file, error)) continue;
        if (io.Fonts->AddFontFromFileTTF(file, kFontPixels * scale) != nullptr) {
            io.FontGlobalScale = 1 / scale;
            return;
        }
    }
    io.Fonts->AddFontDefault();
}

}  // namespace

void set_style(float scale) {
    load_font(scale > 0 ? scale : 1);
    ImGui::StyleColorsDark();
    ImGuiStyle& style = ImGui::GetStyle();
    style.WindowRounding = 0;
    style.FrameRounding = 3;
    style.GrabRounding = 3;
    style.WindowBorderSize = 0;
    style.WindowPadding = {12, 10};
    style.ItemSpacing = {8, 6};
    style.Colors[ImGuiCol_WindowBg] = {0, 0, 0, 0};
    style.Colors[ImGuiCol_PopupBg] = {0.14f, 0.15f, 0.17f, 1};
    style.Colors[ImGuiCol_FrameBg] = {0.18f, 0.195f, 0.22f, 1};
    // Values of sliders stand over the grab.
    style.Colors[ImGuiCol_SliderGrab] = {0.26f, 0.42f, 0.64f, 1};
    style.Colors[ImGuiCol_SliderGrabActive] = {0.32f, 0.5f, 0.75f, 1};
    style.Colors[ImGuiCol_Separator] = {0.24f, 0.26f, 0.29f, 1};
    style.Colors[ImGuiCol_Header] = {0.18f, 0.22f, 0.27f, 1};
}

}  // namespace mray::app
