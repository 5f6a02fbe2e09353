#include "app/view/window/input.h"

#include <GLFW/glfw3.h>
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
/// In distances to the target a second.
constexpr double kFlySpeed = 0.6;
/// As a part of the image's width, how near the pointer must be to the wipe to move it.
constexpr float kWipeReach = 0.01f;

double held(int key) { return glfwGetKey(glfwGetCurrentContext(), key) == GLFW_PRESS ? 1.0 : 0.0; }

template <class T, std::size_t N>
void choose_next(const Choice<T> (&choices)[N], T& value) {
    for (std::size_t i = 0; i < N; ++i) {
        if (choices[i].value != value) continue;
        value = choices[(i + 1) % N].value;
        return;
    }
}

}  // namespace

InputActions Input::apply(const ScreenRect& canvas, float pixel_scale,
                          std::span<const KeyPress> keys, ViewState& state) {
    InputActions actions;
    const ImGuiIO& io = ImGui::GetIO();
    const bool is_over = !io.WantCaptureMouse && canvas.contains(io.MousePos.x, io.MousePos.y);
    const bool is_held = io.MouseDown[0] || io.MouseDown[1] || io.MouseDown[2];
    const Pixel pixel = {
        static_cast<std::uint32_t>(std::max(0.0f, (io.MousePos.x - canvas.x) * pixel_scale)),
        static_cast<std::uint32_t>(std::max(0.0f, (io.MousePos.y - canvas.y) * pixel_scale))};
    if (drag_ == Drag::kNone && is_over && is_held) {
        begin_drag(canvas, state);
    } else if (drag_ != Drag::kNone && !is_held) {
        if (drag_ == Drag::kOrbit && !has_moved_ && is_over) actions.clicked = pixel;
        drag_ = Drag::kNone;
    }
    if (drag_ != Drag::kNone) drag(canvas, state);
    if (is_over && io.MouseWheel != 0) state.camera.zoom(std::pow(kZoomFactor, io.MouseWheel));
    flies_ = false;
    for (const KeyPress& key : keys) actions.escapes |= key.key == GLFW_KEY_ESCAPE;
    if (io.WantTextInput) return actions;
    if (!io.KeyCtrl) fly(state);
    for (const KeyPress& key : keys) {
        if (!key.with_ctrl) press(key.key, state, actions);
        if (key.with_ctrl && key.key == GLFW_KEY_Q) actions.quits = true;
    }
    return actions;
}

void Input::begin_drag(const ScreenRect& canvas, ViewState& state) {
    const ImGuiIO& io = ImGui::GetIO();
    has_moved_ = false;
    const float part = (io.MousePos.x - canvas.x) / canvas.width;
    if (state.comparison == Comparison::kWipe && std::abs(part - state.wipe) < kWipeReach) {
        drag_ = Drag::kWipe;
    } else if (io.MouseDown[0] && !io.KeyShift) {
        drag_ = Drag::kOrbit;
    } else {
        drag_ = Drag::kPan;
    }
}

void Input::drag(const ScreenRect& canvas, ViewState& state) {
    const ImGuiIO& io = ImGui::GetIO();
    const double right = io.MouseDelta.x / canvas.height;
    const double down = io.MouseDelta.y / canvas.height;
    if (right == 0 && down == 0) return;
    has_moved_ = true;
    switch (drag_) {
        case Drag::kOrbit:
            state.camera.orbit(-right * kOrbitRadians, down * kOrbitRadians);
            break;
        case Drag::kPan:
            state.camera.pan(right, down);
            break;
        case Drag::kWipe:
            state.wipe = std::clamp((io.MousePos.x - canvas.x) / canvas.width, 0.0f, 1.0f);
            break;
        case Drag::kNone:
            break;
    }
}

void Input::fly(ViewState& state) {
    const double right = held(GLFW_KEY_D) - held(GLFW_KEY_A);
    const double up = held(GLFW_KEY_E) - held(GLFW_KEY_Q);
    const double forward = held(GLFW_KEY_W) - held(GLFW_KEY_S);
    if (right == 0 && up == 0 && forward == 0) return;
    flies_ = true;
    // A long pause between two frames must not throw the camera away.
    const double seconds = std::min(static_cast<double>(ImGui::GetIO().DeltaTime), 0.1);
    const double way = state.camera.distance() * kFlySpeed * seconds;
    state.camera.fly(right * way, up * way, forward * way);
}

void Input::press(int key, ViewState& state, InputActions& actions) {
    Playback& playback = state.playback;
    const int number = key - GLFW_KEY_1;
    if (number >= 0 && number < static_cast<int>(std::size(kShadings)))
        state.shading = kShadings[number].value;
    if (key == GLFW_KEY_SPACE) playback.playing = !playback.playing;
    if (key == GLFW_KEY_LEFT) playback.step(-1);
    if (key == GLFW_KEY_RIGHT) playback.step(1);
    if (key == GLFW_KEY_HOME) playback.seek(playback.first());
    if (key == GLFW_KEY_END) playback.seek(playback.last());
    if (key == GLFW_KEY_V) {
        const bool is_cpu = state.backend == BackendChoice::kCpu;
        state.backend = is_cpu ? BackendChoice::kVulkan : BackendChoice::kCpu;
    }
    if (key == GLFW_KEY_M) choose_next(kComparisons, state.comparison);
    if (key == GLFW_KEY_B) state.box_depth = state.box_depth >= 5 ? -1 : state.box_depth + 1;
    if (key == GLFW_KEY_P) actions.screenshot = true;
    if (key == GLFW_KEY_C) actions.copy_command = true;
    if (key == GLFW_KEY_H || key == GLFW_KEY_F1) actions.switch_keys = !actions.switch_keys;
    if (key == GLFW_KEY_R) actions.reset_camera = true;
}

}  // namespace mray::app
