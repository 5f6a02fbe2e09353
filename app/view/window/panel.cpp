#include "app/view/window/panel.h"

#include <fmt/format.h>
#include <imgui.h>

#include <algorithm>
#include <array>

#include "app/base/choices.h"
#include "app/view/strips.h"
#include "app/view/window/style.h"

namespace mray::app {
namespace {

using morphray::Shading;

void text(const std::string& line) { ImGui::TextUnformatted(line.c_str()); }

void coloured(unsigned colour, const std::string& line) {
    ImGui::PushStyleColor(ImGuiCol_Text, colour);
    ImGui::PushTextWrapPos();
    text(line);
    ImGui::PopTextWrapPos();
    ImGui::PopStyleColor();
}

void heading(const char* name) {
    ImGui::Spacing();
    ImGui::PushStyleColor(ImGuiCol_Text, kFaintColour);
    ImGui::TextUnformatted(name);
    ImGui::PopStyleColor();
    ImGui::Separator();
}

/// A row of two columns: a name, and what follows.
void label(const char* name) {
    ImGui::AlignTextToFramePadding();
    ImGui::TextUnformatted(name);
    ImGui::SameLine(6.2f * ImGui::GetFontSize());
    ImGui::SetNextItemWidth(-1);
}

void figure(const char* name, const std::string& value) {
    ImGui::TextUnformatted(name);
    ImGui::SameLine(8.5f * ImGui::GetFontSize());
    text(value);
}

/// A list to choose from.
template <class T, std::size_t N>
void choose(const char* name, const Choice<T> (&choices)[N], T& value) {
    label(name);
    const char* shown = "";
    for (const Choice<T>& choice : choices)
        if (choice.value == value) shown = choice.name;
    if (!ImGui::BeginCombo(fmt::format("##{}", name).c_str(), shown)) return;
    for (const Choice<T>& choice : choices)
        if (ImGui::Selectable(choice.name, choice.value == value)) value = choice.value;
    ImGui::EndCombo();
}

constexpr Choice<BackendChoice> kShownBackends[] = {{"CPU", BackendChoice::kCpu},
                                                    {"Vulkan", BackendChoice::kVulkan}};
constexpr Choice<Comparison> kShownComparisons[] = {{"one backend", Comparison::kOff},
                                                    {"side by side", Comparison::kSide},
                                                    {"wipe", Comparison::kWipe},
                                                    {"difference", Comparison::kDifference}};

void draw_rates(const PanelFacts& facts) {
    figure("presented", rate_text(facts.presented_rate, facts.moves, "images/s"));
    figure("with presenting", rate_text(facts.presented_mrays, facts.moves, "Mray/s"));
    figure("tracing alone", fmt::format("{:.1f} Mray/s", facts.traced_mrays));
    if (facts.image == nullptr) return;
    for (const TracedPane& pane : facts.image->panes) {
        const bool is_two = facts.image->panes.size() > 1;
        if (is_two) text(pane.backend == BackendChoice::kVulkan ? "Vulkan" : "CPU");
        figure("deform", fmt::format("{:.2f} ms", pane.deform_ms));
        figure("update",
               fmt::format("{:.2f} ms  {}", pane.update_ms, morphray::to_string(pane.update.step)));
        const bool is_apart = pane.shade_ms > 0;
        figure(is_apart ? "trace" : "trace, shade", fmt::format("{:.2f} ms", pane.trace_ms));
        if (is_apart) figure("shade", fmt::format("{:.2f} ms", pane.shade_ms));
    }
    const ImageRequest& request = facts.image->request;
    figure("image", fmt::format("{}x{}, {} sample{}", request.view.width, request.view.height,
                                request.samples, request.samples == 1 ? "" : "s"));
}

void draw_backends(ViewState& state, const PanelFacts& facts) {
    choose("show", kShownComparisons, state.comparison);
    if (state.comparison == Comparison::kOff) {
        choose("backend", kShownBackends, state.backend);
    } else if (state.comparison == Comparison::kWipe) {
        label("wipe");
        ImGui::SliderFloat("##wipe", &state.wipe, 0, 1, "%.2f");
    }
    if (facts.different) {
        coloured(*facts.different == 0 ? kGoodColour : kBadColour,
                 fmt::format("{} pixel{} differ{}", *facts.different,
                             *facts.different == 1 ? "" : "s", *facts.different == 1 ? "s" : ""));
    }
}

void draw_image(ViewState& state) {
    choose("shading", kShadings, state.shading);
    if (state.shading == Shading::plain) choose("rays", kRays, state.rays);
    const bool is_lit = state.shading == Shading::lit;
    choose("still image", kSampleCounts, state.samples);
    if (is_lit) {
        label("AO rays");
        int count = static_cast<int>(state.ao_count);
        if (ImGui::SliderInt("##ao", &count, 0, 64))
            state.ao_count = static_cast<std::uint32_t>(std::clamp(count, 0, 256));
    }
    if (is_lit || state.shading == Shading::normal) ImGui::Checkbox("flat", &state.flat);
    if (is_lit) {
        ImGui::SameLine();
        ImGui::Checkbox("ground", &state.scene.ground);
    }
}

void draw_tree(ViewState& state) {
    constexpr std::array kPolicies = {PolicySpec{PolicyKind::kAuto}, PolicySpec{PolicyKind::kRefit},
                                      PolicySpec{PolicyKind::kRebuild},
                                      PolicySpec{PolicyKind::kEvery, 8}};
    label("update");
    if (ImGui::BeginCombo("##update", text_of(state.scene.update).c_str())) {
        for (const PolicySpec& policy : kPolicies)
            if (ImGui::Selectable(text_of(policy).c_str(), state.scene.update == policy))
                state.scene.update = policy;
        ImGui::EndCombo();
    }
    label("boxes");
    ImGui::SliderInt("##boxes", &state.box_depth, -1, 5, state.box_depth < 0 ? "off" : "depth %d");
}

void draw_pixel(const PanelFacts& facts, PanelActions& actions) {
    if (facts.pixel.empty()) {
        coloured(kFaintColour, "click on the image");
        return;
    }
    text(facts.pixel);
    actions.copy_probe = ImGui::Button("copy probe command");
    ImGui::SameLine();
    actions.close_pixel = ImGui::Button("close");
}

}  // namespace

PanelActions draw_panel(const ScreenRect& rect, ViewState& state, const PanelFacts& facts) {
    PanelActions actions;
    ImGui::SetNextWindowPos({rect.x, rect.y});
    ImGui::SetNextWindowSize({rect.width, rect.height});
    constexpr ImGuiWindowFlags kFixed = ImGuiWindowFlags_NoTitleBar | ImGuiWindowFlags_NoResize |
                                        ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoSavedSettings |
                                        ImGuiWindowFlags_NoBackground |
                                        ImGuiWindowFlags_NoBringToFrontOnFocus;
    ImGui::Begin("panel", nullptr, kFixed);
    draw_rates(facts);
    heading("BACKEND");
    draw_backends(state, facts);
    bool vsync = facts.vsync;
    actions.switch_vsync = ImGui::Checkbox("wait for the screen (vsync)", &vsync);
    heading("IMAGE");
    draw_image(state);
    heading("TREE");
    draw_tree(state);
    heading("CAMERA AND LIGHT");
    actions.reset_camera = ImGui::Button("reset camera");
    ImGui::SameLine();
    actions.light_here = ImGui::Button("light from here");
    actions.screenshot = ImGui::Button("screenshot");
    ImGui::SameLine();
    actions.copy_command = ImGui::Button("copy command");
    if (!facts.is_reproducible)
        coloured(kFaintColour, "the command leaves out what became of the tree");
    if (!facts.message.empty()) coloured(kGoodColour, facts.message);
    if (facts.image != nullptr && !facts.image->error.empty())
        coloured(kBadColour, facts.image->error);
    heading("PIXEL");
    draw_pixel(facts, actions);
    ImGui::End();
    return actions;
}

}  // namespace mray::app
