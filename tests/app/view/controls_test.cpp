// The mouse on the image: what a frame of the window makes of it.
#include "app/view/viewer.h"

#include <gtest/gtest.h>
#include <imgui.h>

namespace mray::app {
namespace {

class Mouse : public testing::Test {
protected:
    Mouse() {
        ImGui::CreateContext();
        ImGuiIO& io = ImGui::GetIO();
        io.IniFilename = nullptr;
        io.DisplaySize = {800, 600};
        io.Fonts->Build();
        frame(100, 100, false);
    }
    ~Mouse() override { ImGui::DestroyContext(); }
    Mouse(const Mouse&) = delete;

    /// Returns the place that was clicked on.
    std::optional<std::array<float, 2>> frame(float x, float y, bool is_down) {
        ImGuiIO& io = ImGui::GetIO();
        io.MousePos = {x, y};
        io.MouseDown[0] = is_down;
        ImGui::NewFrame();
        const InputActions actions = apply_input(600, {}, first_, state_);
        ImGui::EndFrame();
        return actions.clicked;
    }

    const Camera first_{{.eye = morphray::Point{0, 0, 4}, .target = morphray::Point{0, 0, 0}}};
    ViewState state_{.playback = {.first = 0, .last = 1}, .camera = first_, .view = {}};
};

TEST_F(Mouse, AMoveBeforeAPressOfTheSameFrameDoesNotOrbit) {
    frame(400, 300, true);
    EXPECT_EQ(state_.camera.eye, first_.eye);
    const auto clicked = frame(400, 300, false);
    ASSERT_TRUE(clicked.has_value());
    EXPECT_EQ(*clicked, (std::array<float, 2>{400, 300}));
    EXPECT_EQ(state_.camera.eye, first_.eye);
}

TEST_F(Mouse, AMoveAfterThePressOrbitsAndPicksNothing) {
    frame(100, 100, true);
    frame(160, 100, true);
    EXPECT_NE(state_.camera.eye, first_.eye);
    EXPECT_FALSE(frame(160, 100, false).has_value());
}

}  // namespace
}  // namespace mray::app
