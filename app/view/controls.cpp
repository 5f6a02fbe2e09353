#include "app/view/controls.h"

#include <GLFW/glfw3.h>
#include <fmt/format.h>
#include <imgui.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "app/base/choices.h"

namespace mray::app {
namespace {

/// Around the target for a drag over the height of the image.
constexpr double kOrbitRadians = std::numbers::pi;
/// For a notch of the wheel.
constexpr double kZoomFactor = 0.88;
/// Lines of deeper boxes cover the image.
constexpr int kDeepestBoxes = 5;

constexpr Choice<BackendChoice> kShownBackends[] = {{"auto", BackendChoice::kAuto},
                                                    {"CPU", BackendChoice::kCpu},
                                                    {"Vulkan", BackendChoice::kVulkan}};

void press(int key, const Camera& first_camera, ViewState& state) {
    Playback& playback = state.playback;
    const int number = key - GLFW_KEY_1;
    if (number >= 0 && number < static_cast<int>(std::size(kShadings)))
        state.view.shading = kShadings[number].value;
    if (key == GLFW_KEY_SPACE) playback.playing = !playback.playing;
    if (key == GLFW_KEY_LEFT) playback.step(-1);
    if (key == GLFW_KEY_RIGHT) playback.step(1);
    if (key == GLFW_KEY_V) {
        const bool is_cpu = state.backend == BackendChoice::kCpu;
        state.backend = is_cpu ? BackendChoice::kVulkan : BackendChoice::kCpu;
    }
    if (key == GLFW_KEY_M) state.shows_difference = !state.shows_difference;
    if (key == GLFW_KEY_B)
        state.box_depth = state.box_depth >= kDeepestBoxes ? -1 : state.box_depth + 1;
    if (key == GLFW_KEY_H) state.shows_panel = !state.shows_panel;
    if (key == GLFW_KEY_R) state.camera = first_camera;
}

template <class T, std::size_t N>
void choose(const char* name, const Choice<T> (&choices)[N], T& value) {
    const auto* const now = std::ranges::find(choices, value, &Choice<T>::value);
    if (!ImGui::BeginCombo(name, now != std::end(choices) ? now->name : "")) return;
    for (const Choice<T>& choice : choices)
        if (ImGui::Selectable(choice.name, choice.value == value)) value = choice.value;
    ImGui::EndCombo();
}

void draw_time(Playback& playback) {
    if (ImGui::Button(playback.playing ? "pause" : "play ")) playback.playing = !playback.playing;
    ImGui::SameLine();
    if (ImGui::Button("<")) playback.step(-1);
    ImGui::SameLine();
    if (ImGui::Button(">")) playback.step(1);
    auto frame = static_cast<float>(playback.frame());
    if (ImGui::SliderFloat("frame", &frame, static_cast<float>(playback.first()),
                           static_cast<float>(playback.last()), "%.2f")) {
        playback.playing = false;
        playback.seek(frame);
    }
    auto speed = static_cast<float>(playback.frames_a_second);
    if (ImGui::SliderFloat("frames/s", &speed, 0.5f, 120, "%.3g", ImGuiSliderFlags_Logarithmic))
        playback.frames_a_second = speed;
}

void draw_tree(ViewState& state) {
    constexpr std::array kPolicies = {PolicySpec{PolicyKind::kAuto}, PolicySpec{PolicyKind::kRefit},
                                      PolicySpec{PolicyKind::kRebuild},
                                      PolicySpec{PolicyKind::kEvery, 8}};
    if (ImGui::BeginCombo("update", text_of(state.update).c_str())) {
        for (const PolicySpec& policy : kPolicies)
            if (ImGui::Selectable(text_of(policy).c_str(), state.update == policy))
                state.update = policy;
        ImGui::EndCombo();
    }
    ImGui::SliderInt("boxes", &state.box_depth, -1, kDeepestBoxes,
                     state.box_depth < 0 ? "off" : "depth %d");
}

std::string figures(const TracedImage& image) {
    std::string text = fmt::format("{}x{}, {} sample{} a pixel\n", image.request.view.width,
                                   image.request.view.height, image.request.view.samples,
                                   image.request.view.samples == 1 ? "" : "s");
    for (const TracedPane& pane : image.panes)
        text += fmt::format(
            "{}\n  deform {:.2f} ms\n  update {:.2f} ms, {}, SAH ratio {:.2f}\n"
            "  trace  {:.2f} ms, {:.1f} Mray/s\n",
            pane.device, pane.deform_ms, pane.update.milliseconds(),
            morphray::to_string(pane.update.step), pane.update.cost_ratio, pane.trace_ms,
            static_cast<double>(pane.rays) / std::max(pane.trace_ms, 1e-6) / 1e3);
    return image.scale.empty() ? text : text + image.scale + '\n';
}

}  // namespace

InputActions apply_input(float height, std::span<const KeyPress> keys, const Camera& first_camera,
                         ViewState& state) {
    InputActions actions;
    const ImGuiIO& io = ImGui::GetIO();
    if (!io.WantCaptureMouse) {
        // In the frame of a press the mouse has moved before it.
        bool is_pressed = false;
        for (int button = 0; button < 3; ++button) is_pressed |= ImGui::IsMouseClicked(button);
        const double right = is_pressed ? 0 : io.MouseDelta.x / height;
        const double down = is_pressed ? 0 : io.MouseDelta.y / height;
        const bool is_left = io.MouseDown[0] && !io.KeyShift;
        if (is_left) state.camera.orbit(-right * kOrbitRadians, down * kOrbitRadians);
        if (!is_left && (io.MouseDown[0] || io.MouseDown[1] || io.MouseDown[2]))
            state.camera.pan(right, down);
        if (io.MouseWheel != 0) state.camera.zoom(std::pow(kZoomFactor, io.MouseWheel));
        const bool has_moved =
            io.MouseDragMaxDistanceSqr[0] > io.MouseDragThreshold * io.MouseDragThreshold;
        if (ImGui::IsMouseReleased(0) && !has_moved)
            actions.clicked = {io.MousePos.x, io.MousePos.y};
    }
    if (io.WantTextInput) return actions;
    for (const KeyPress& key : keys) {
        if (!key.with_ctrl) press(key.key, first_camera, state);
        if (key.with_ctrl && key.key == GLFW_KEY_Q) actions.quits = true;
    }
    return actions;
}

void draw_panel(float left, float width, float height, ViewState& state, const PanelFacts& facts) {
    ImGui::SetNextWindowPos({left, 0});
    ImGui::SetNextWindowSize({width, height});
    ImGui::Begin("panel", nullptr,
                 ImGuiWindowFlags_NoTitleBar | ImGuiWindowFlags_NoResize | ImGuiWindowFlags_NoMove |
                     ImGuiWindowFlags_NoSavedSettings);
    ImGui::PushItemWidth(-90);
    draw_time(state.playback);
    ImGui::Separator();
    choose("backend", kShownBackends, state.backend);
    ImGui::Checkbox("difference of CPU and Vulkan", &state.shows_difference);
    choose("shading", kShadings, state.view.shading);
    if (state.view.shading == morphray::Shading::plain) choose("rays", kRays, state.view.rays);
    choose("samples", kSampleCounts, state.view.samples);
    draw_tree(state);
    ImGui::Separator();
    ImGui::PushTextWrapPos();
    if (facts.image != nullptr) ImGui::TextUnformatted(figures(*facts.image).c_str());
    ImGui::TextUnformatted(facts.message.c_str());
    ImGui::Separator();
    ImGui::TextUnformatted(facts.pixel.empty() ? "click on a pixel" : facts.pixel.c_str());
    ImGui::Separator();
    ImGui::TextUnformatted(
        "drag: orbit, shift-drag: pan, wheel: zoom\nspace: play, left and right: a frame\n"
        "1 to 7: shading, V: backend, M: difference\nB: boxes, R: first camera, H: this panel\n"
        "ctrl-Q: end");
    ImGui::PopTextWrapPos();
    ImGui::PopItemWidth();
    ImGui::End();
}

}  // namespace mray::app
