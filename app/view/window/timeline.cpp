#include "app/view/window/timeline.h"

#include <fmt/format.h>
#include <imgui.h>

#include <algorithm>
#include <functional>

#include "app/view/window/style.h"

namespace mray::app {
namespace {

using morphray::Step;

void draw_controls(ViewState& state) {
    Playback& playback = state.playback;
    const float unit = ImGui::GetFontSize();
    if (ImGui::Button(playback.playing ? "pause" : "play", {4 * unit, 0}))
        playback.playing = !playback.playing;
    ImGui::SameLine();
    if (ImGui::Button("<")) playback.step(-1);
    ImGui::SameLine();
    if (ImGui::Button(">")) playback.step(1);
    ImGui::SameLine();
    ImGui::Checkbox("loop", &playback.loop);
    ImGui::SameLine();
    ImGui::SetNextItemWidth(9 * unit);
    auto speed = static_cast<float>(playback.frames_a_second);
    if (ImGui::SliderFloat("##speed", &speed, 0.5f, 120, "%.3g frames/s",
                           ImGuiSliderFlags_Logarithmic))
        playback.frames_a_second = std::clamp(speed, 0.1f, 1000.0f);
    ImGui::SameLine();
    ImGui::SetNextItemWidth(-1);
    auto frame = static_cast<float>(playback.frame());
    if (ImGui::SliderFloat("##frame", &frame, static_cast<float>(playback.first()),
                           static_cast<float>(playback.last()), "frame %.2f")) {
        playback.playing = false;
        playback.seek(frame);
    }
}

/// The colour of what an update did; 0 for what happens all the time.
unsigned event_colour(Step step) {
    switch (step) {
        case Step::build:
        case Step::rebuild:
            return 0xFF5060F0u;
        case Step::restructure:
            return 0xFF40C0F0u;
        case Step::swap:
            return 0xFFF080C0u;
        default:
            return 0;
    }
}

/// One strip: a value for each sample, as bars from the bottom.
struct Strip {
    const char* name;
    const char* unit;
    unsigned colour;
    std::function<float(const StripSample&)> value;
    /// The least value that fills the height.
    float least = 0;
    /// The value at the bottom.
    float bottom = 0;
};

void draw_strip(const Strip& strip, std::span<const StripSample> samples, ImVec2 corner,
                ImVec2 size, bool with_events) {
    ImDrawList& list = *ImGui::GetWindowDrawList();
    list.AddRectFilled(corner, {corner.x + size.x, corner.y + size.y}, 0xFF241E1Bu, 3);
    float most = strip.least;
    for (const StripSample& sample : samples) most = std::max(most, strip.value(sample));
    const float bar = size.x / static_cast<float>(Strips::kLength);
    const float range = std::max(most - strip.bottom, 1e-6f);
    for (std::size_t i = 0; i < samples.size(); ++i) {
        const float x = corner.x + static_cast<float>(i) * bar;
        const float part = std::clamp((strip.value(samples[i]) - strip.bottom) / range, 0.0f, 1.0f);
        const float y = corner.y + size.y - part * (size.y - 3);
        list.AddRectFilled({x, y}, {x + std::max(bar, 1.0f), corner.y + size.y}, strip.colour);
        const unsigned event = with_events ? event_colour(samples[i].step) : 0;
        if (event != 0)
            list.AddRectFilled({x, corner.y}, {x + std::max(bar, 2.0f), corner.y + 6}, event);
    }
    const float newest = samples.empty() ? strip.bottom : strip.value(samples.back());
    const std::string text =
        fmt::format("{} {:.2f}{}  (top {:.2f})", strip.name, newest, strip.unit, most);
    const ImVec2 at = {corner.x + 6, corner.y + 3};
    list.AddText({at.x + 1, at.y + 1}, 0xFF000000u, text.c_str());
    list.AddText(at, 0xFFE8E8E8u, text.c_str());
}

void draw_key() {
    constexpr std::pair<const char*, Step> kEvents[] = {
        {"build", Step::rebuild}, {"restructure", Step::restructure}, {"swap", Step::swap}};
    for (const auto& [name, step] : kEvents) {
        ImGui::PushStyleColor(ImGuiCol_Text, event_colour(step));
        ImGui::TextUnformatted("|");
        ImGui::PopStyleColor();
        ImGui::SameLine(0, 4);
        ImGui::TextUnformatted(name);
        ImGui::SameLine();
    }
    ImGui::PushStyleColor(ImGuiCol_Text, kFaintColour);
    ImGui::TextUnformatted(
        "H: keys   drag: orbit   shift-drag: pan   wheel: zoom   W A S D Q E: fly");
    ImGui::PopStyleColor();
}

}  // namespace

void draw_timeline(const ScreenRect& rect, ViewState& state, const Strips& strips) {
    ImGui::SetNextWindowPos({rect.x, rect.y});
    ImGui::SetNextWindowSize({rect.width, rect.height});
    constexpr ImGuiWindowFlags kFixed =
        ImGuiWindowFlags_NoTitleBar | ImGuiWindowFlags_NoResize | ImGuiWindowFlags_NoMove |
        ImGuiWindowFlags_NoScrollbar | ImGuiWindowFlags_NoSavedSettings |
        ImGuiWindowFlags_NoBackground | ImGuiWindowFlags_NoBringToFrontOnFocus;
    ImGui::Begin("timeline", nullptr, kFixed);
    draw_controls(state);
    const Strip shown[] = {
        {"update", " ms", kUpdateColour, [](const StripSample& s) { return s.update_ms; }, 1},
        {"trace", " ms", kTraceColour, [](const StripSample& s) { return s.trace_ms; }, 1},
        {"SAH ratio", "", kCostColour, [](const StripSample& s) { return s.cost_ratio; }, 1.5f, 1},
    };
    const ImVec2 corner = ImGui::GetCursorScreenPos();
    const ImVec2 room = ImGui::GetContentRegionAvail();
    const float gap = 8;
    const float width = (room.x - 2 * gap) / 3;
    const float height = room.y - ImGui::GetTextLineHeightWithSpacing();
    for (int i = 0; i < 3; ++i) {
        const float x = corner.x + static_cast<float>(i) * (width + gap);
        draw_strip(shown[i], strips.samples(), {x, corner.y}, {width, height}, i != 1);
    }
    ImGui::SetCursorScreenPos({corner.x, corner.y + height + 4});
    draw_key();
    ImGui::End();
}

}  // namespace mray::app
