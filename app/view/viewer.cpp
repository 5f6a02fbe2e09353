#include "app/view/viewer.h"

#include <GLFW/glfw3.h>
#include <backends/imgui_impl_glfw.h>
#include <backends/imgui_impl_opengl2.h>
#include <imgui.h>

#include <cstdlib>
#include <numbers>

#include "app/animation/frames.h"
#include "common/base/output_file.h"
#include "common/image/png.h"

namespace mray::app {
namespace {

[[noreturn]] void fail(const char* what) {
    const char* reason = nullptr;
    glfwGetError(&reason);
    throw Error(ErrorKind::kUnavailable,
                "view: {} ({}); a window needs an X11 display and OpenGL 2.1, which Mesa's "
                "software renderer has, too",
                what, reason != nullptr ? reason : "no reason given");
}

/// The one window of the program, used by the main thread alone: Dear ImGui, with an image behind
/// it, and lines of OpenGL over both.
class Window {
public:
    /// Throws Error(kUnavailable) without a display or without OpenGL 2.1.
    Window(const std::string& title, int width, int height) {
        glfwWindowHint(GLFW_CONTEXT_VERSION_MAJOR, 2);
        glfwWindowHint(GLFW_CONTEXT_VERSION_MINOR, 1);
        glfwWindowHint(GLFW_DEPTH_BITS, 0);
        glfwWindowHint(GLFW_STENCIL_BITS, 0);
        window_ = glfwCreateWindow(width, height, title.c_str(), nullptr, nullptr);
        if (window_ == nullptr) fail("no window can be opened");
        glfwSetWindowSizeLimits(window_, 640, 400, GLFW_DONT_CARE, GLFW_DONT_CARE);
        glfwMakeContextCurrent(window_);
        glfwSwapInterval(1);
        glfwSetWindowUserPointer(window_, &keys_);
        // Dear ImGui puts its callback before this one.
        glfwSetKeyCallback(window_, [](GLFWwindow* window, int key, int, int action, int mods) {
            if (action != GLFW_PRESS) return;
            static_cast<std::vector<KeyPress>*>(glfwGetWindowUserPointer(window))
                ->push_back({key, (mods & GLFW_MOD_CONTROL) != 0});
        });
        glGenTextures(1, &texture_);
        glBindTexture(GL_TEXTURE_2D, texture_);
        glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
        glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
        IMGUI_CHECKVERSION();
        ImGui::CreateContext();
        // No file of settings in the folder that the program is started in.
        ImGui::GetIO().IniFilename = nullptr;
        ImGui::StyleColorsDark();
        ImGui::GetStyle().WindowRounding = 0;
        ImGui::GetStyle().Colors[ImGuiCol_WindowBg].w = 1;
        ImGui_ImplGlfw_InitForOpenGL(window_, true);
        ImGui_ImplOpenGL2_Init();
    }
    ~Window() {
        glDeleteTextures(1, &texture_);
        ImGui_ImplOpenGL2_Shutdown();
        ImGui_ImplGlfw_Shutdown();
        ImGui::DestroyContext();
        glfwDestroyWindow(window_);
    }
    Window(const Window&) = delete;
    Window& operator=(const Window&) = delete;

    bool closes() const { return glfwWindowShouldClose(window_) != 0; }
    /// The keys that went down since the last call, in order: also those that are up again.
    std::vector<KeyPress> take_keys() { return std::exchange(keys_, {}); }

    /// In screen coordinates.
    ImVec2 size() const {
        int width = 0;
        int height = 0;
        glfwGetWindowSize(window_, &width, &height);
        return {static_cast<float>(width), static_cast<float>(height)};
    }
    /// 8-bit RGBA pixels from the top, and the ends of lines over them, in clip space of the image.
    void set_image(const morphray::View& view, std::span<const std::uint32_t> pixels,
                   std::vector<glm::vec4> line_ends) {
        glBindTexture(GL_TEXTURE_2D, texture_);
        glTexImage2D(GL_TEXTURE_2D, 0, GL_RGBA8, static_cast<GLsizei>(view.width),
                     static_cast<GLsizei>(view.height), 0, GL_RGBA, GL_UNSIGNED_BYTE,
                     pixels.data());
        has_image_ = true;
        line_ends_ = std::move(line_ends);
        float nearest = std::numeric_limits<float>::infinity();
        float farthest = 0;
        for (const glm::vec4& end : line_ends_) {
            if (end.w > 0) nearest = std::min(nearest, end.w);
            farthest = std::max(farthest, end.w);
        }
        line_colours_.clear();
        for (const glm::vec4& end : line_ends_) {
            const float along =
                std::max(end.w - nearest, 0.0f) / std::max(farthest - nearest, 1e-30f);
            line_colours_.emplace_back(1.0f, 0.75f, 0.2f, 0.9f - 0.75f * along);
        }
    }

    void begin_frame() {
        ImGui_ImplOpenGL2_NewFrame();
        ImGui_ImplGlfw_NewFrame();
        ImGui::NewFrame();
    }

    /// The image in the left part, of this width.
    void draw_image(ImDrawList& list, float width) const {
        const auto id = reinterpret_cast<ImTextureID>(static_cast<std::intptr_t>(texture_));
        if (has_image_) list.AddImage(id, {0, 0}, {width, size().y});
    }

    /// Draws Dear ImGui's frame, and lines over the image; presents both.
    void end_frame(float image_width) {
        ImGui::Render();
        int width = 0;
        int height = 0;
        glfwGetFramebufferSize(window_, &width, &height);
        glViewport(0, 0, width, height);
        glClearColor(0.06f, 0.065f, 0.07f, 1);
        glClear(GL_COLOR_BUFFER_BIT);
        ImGui_ImplOpenGL2_RenderDrawData(ImGui::GetDrawData());
        // The viewport becomes the image.
        const float part = image_width / std::max(size().x, 1.0f);
        glViewport(0, 0, static_cast<GLsizei>(part * static_cast<float>(width)), height);
        draw_lines();
        glfwSwapBuffers(window_);
    }

private:
    /// GLFW, which ends with the window, or where none can be opened.
    struct Library {
        Library() {
#ifdef GLFW_PLATFORM
            // On Wayland a window has no frame without a plugin of libdecor, and glfwTerminate()
            // crashes.
            if (std::getenv("DISPLAY") != nullptr) glfwInitHint(GLFW_PLATFORM, GLFW_PLATFORM_X11);
#endif
            if (glfwInit() != GLFW_TRUE) fail("no display can be opened");
        }
        ~Library() { glfwTerminate(); }
    };

    void draw_lines() const {
        glEnable(GL_BLEND);
        glBlendFunc(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA);
        glEnableClientState(GL_VERTEX_ARRAY);
        glVertexPointer(4, GL_FLOAT, 0, line_ends_.data());
        glEnableClientState(GL_COLOR_ARRAY);
        glColorPointer(4, GL_FLOAT, 0, line_colours_.data());
        glDrawArrays(GL_LINES, 0, static_cast<GLsizei>(line_ends_.size()));
        glDisableClientState(GL_COLOR_ARRAY);
        glDisableClientState(GL_VERTEX_ARRAY);
        glDisable(GL_BLEND);
    }

    Library library_;
    GLFWwindow* window_ = nullptr;
    std::vector<KeyPress> keys_;
    unsigned texture_ = 0;
    bool has_image_ = false;
    std::vector<glm::vec4> line_ends_;
    /// They fade with the distance from the eye.
    std::vector<glm::vec4> line_colours_;
};

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
    auto frame = static_cast<float>(playback.frame);
    if (ImGui::SliderFloat("frame", &frame, static_cast<float>(playback.first),
                           static_cast<float>(playback.last), "%.2f")) {
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
    const morphray::View& view = image.request.view;
    std::string text = fmt::format("{}x{}, {} sample{} a pixel\n", view.width, view.height,
                                   view.samples, view.samples == 1 ? "" : "s");
    for (const TracedPane& pane : image.panes)
        text += fmt::format(
            "{}\n  deform {:.2f} ms\n  update {:.2f} ms, {}, SAH ratio {:.2f}\n"
            "  trace  {:.2f} ms, {:.1f} Mray/s\n",
            pane.device, pane.deform_ms, pane.update.milliseconds(),
            morphray::to_string(pane.update.step), pane.update.cost_ratio, pane.trace_ms,
            static_cast<double>(pane.rays) / std::max(pane.trace_ms, 1e-6) / 1e3);
    return text;
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

namespace {

constexpr int kPanelWidth = 330;
/// The time without a change after which an image is refined.
constexpr double kStillSeconds = 0.12;
/// Between two looks at the clock; images and input end the wait.
constexpr double kIdleSeconds = 0.1;
/// Samples of an image that is refined by itself: they take 1.6 GB.
constexpr std::uint64_t kMostSamples = std::uint64_t{1} << 25;

std::uint32_t pixels_of(float length) {
    return static_cast<std::uint32_t>(std::max(std::lround(length), 1L));
}

/// The engine traces the next image while this one is drawn, and no call waits for it.
class Viewer {
public:
    Viewer(const Options& options, const Messages& messages)
        : options_(options),
          animation_(open_animation(options_.source, messages)),
          state_(initial_state(options_, *animation_, select_frame(options_, *animation_))),
          first_camera_(state_.camera),
          window_("morphray view " + escape(animation_->name()),
                  static_cast<int>(state_.view.width) + kPanelWidth,
                  static_cast<int>(state_.view.height)),
          engine_(options_, *animation_, messages, glfwPostEmptyEvent) {
        if (!options_.screenshot.empty()) return;
        // The screen may be smaller than the window that was asked for.
        take_size(options_.view);
        const double frame = state_.playback.frame;
        state_ = initial_state(options_, *animation_, frame);
        first_camera_ = state_.camera;
    }

    void run() {
        last_ = glfwGetTime();
        while (step()) throw_if_interrupted();
    }

private:
    float panel_width() const { return state_.shows_panel ? kPanelWidth : 0; }
    float image_width() const { return std::max(window_.size().x - panel_width(), 1.0f); }

    bool step() {
        glfwWaitEventsTimeout(kIdleSeconds);
        if (window_.closes()) return false;
        const bool is_new = take_image();
        if (is_done_) return false;
        window_.begin_frame();
        const float height = window_.size().y;
        const InputActions actions =
            apply_input(height, window_.take_keys(), first_camera_, state_);
        const double now = glfwGetTime();
        state_.playback.advance(now - std::exchange(last_, now));
        // A screenshot has the size of the options.
        if (options_.screenshot.empty()) {
            take_size(state_.view);
            if (actions.clicked) {
                const auto [x, y] = *actions.clicked;
                asked_ = request_of(state_, 0);
                asked_->pixel = Pixel{std::min(pixels_of(x), state_.view.width) - 1,
                                      std::min(pixels_of(y), state_.view.height) - 1};
                engine_.post(*asked_);
            }
        }
        // The next image is traced while this one is drawn.
        post(now);
        if (is_new && !image_->panes.empty()) {
            const TracedPane& pane = image_->panes.front();
            std::vector<std::uint32_t> shown = pane.pixels;
            different_.reset();
            if (image_->panes.size() > 1) {
                DifferenceImage difference = difference_of(pane, image_->panes[1]);
                different_ = difference.different;
                shown = std::move(difference.pixels);
            }
            window_.set_image(image_->request.view, shown,
                              box_lines(image_->request.view, image_->boxes));
        }
        draw();
        return !actions.quits;
    }

    void take_size(morphray::View& view) const {
        view.width = pixels_of(image_width());
        view.height = pixels_of(window_.size().y);
    }

    /// Asks for the first image of a state that has changed, and for a better one when it is still.
    void post(double now) {
        if (asked_) return;
        // A screenshot shows the complete image, so coarser ones are left out.
        const int first = options_.screenshot.empty() ? 0 : last_step(state_);
        ImageRequest fresh = request_of(state_, first);
        if (step_ < 0 || fresh != first_request_) {
            first_request_ = std::move(fresh);
            pixel_.reset();
            posted_ = first_request_;
            step_ = first;
            changed_at_ = now;
        } else {
            const bool is_still = now - changed_at_ >= kStillSeconds && !state_.playback.playing;
            if (!is_answered_ || !is_still || step_ >= last_step(state_)) return;
            ImageRequest better = request_of(state_, step_ + 1);
            const std::uint64_t pixels = std::uint64_t{better.view.width} * better.view.height;
            if (better.view.samples > 1 && pixels * better.view.samples > kMostSamples) return;
            ++step_;
            posted_ = std::move(better);
        }
        is_answered_ = false;
        engine_.post(posted_);
    }

    bool take_image() {
        std::unique_ptr<TracedImage> image = engine_.take();
        if (!image) return false;
        if (image->request.pixel) {
            if (image->request == asked_) asked_.reset();
            if (image->error.empty()) pixel_ = std::move(image);
            // It may have taken the place of an image.
            if (step_ >= 0 && !is_answered_) engine_.post(posted_);
            return false;
        }
        if (image->request == posted_) is_answered_ = true;
        image_ = std::move(image);
        if (!options_.screenshot.empty() && is_answered_ && !image_->panes.empty()) {
            const morphray::View& view = image_->request.view;
            write_file(options_.screenshot,
                       encode_png(Image{view.width, view.height, image_->panes.front().pixels}));
            is_done_ = true;
        }
        return true;
    }

    void draw_label(ImDrawList& list) const {
        const std::string text =
            fmt::format("difference of CPU and Vulkan: {} pixels differ (white)", *different_);
        const ImVec2 size = ImGui::CalcTextSize(text.c_str());
        list.AddRectFilled({4, 4}, {12 + size.x, 12 + size.y}, 0xFF404040u);
        list.AddText({8, 8}, 0xFFFFFFFFu, text.c_str());
    }

    void draw_panel(const std::string& pixel) {
        ImGui::SetNextWindowPos({image_width(), 0});
        ImGui::SetNextWindowSize({panel_width(), window_.size().y});
        ImGui::Begin("panel", nullptr,
                     ImGuiWindowFlags_NoTitleBar | ImGuiWindowFlags_NoResize |
                         ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoSavedSettings);
        ImGui::PushItemWidth(-90);
        draw_time(state_.playback);
        ImGui::Separator();
        choose("backend", kShownBackends, state_.backend);
        ImGui::Checkbox("difference of CPU and Vulkan", &state_.shows_difference);
        choose("shading", kShadings, state_.view.shading);
        if (state_.view.shading == morphray::Shading::plain)
            choose("rays", kRays, state_.view.rays);
        choose("samples", kSampleCounts, state_.view.samples);
        draw_tree(state_);
        ImGui::Separator();
        ImGui::PushTextWrapPos();
        const std::string scale =
            image_ && !image_->scale.empty() ? image_->scale + '\n' : std::string();
        const std::string facts = image_ ? figures(*image_) + scale + image_->error
                                         : fmt::format("building the tree, {} triangles",
                                                       animation_->topology().triangles.size());
        ImGui::TextUnformatted(facts.c_str());
        ImGui::Separator();
        ImGui::TextUnformatted(pixel.empty() ? "click on a pixel" : pixel.c_str());
        ImGui::Separator();
        ImGui::TextUnformatted(
            "drag: orbit, shift-drag: pan, wheel: zoom\nspace: play, left and right: a frame\n"
            "1 to 5: shading, V: backend, M: difference\nB: boxes, R: first camera, H: this "
            "panel\nctrl-Q: end");
        ImGui::PopTextWrapPos();
        ImGui::PopItemWidth();
        ImGui::End();
    }

    void draw() {
        const float width = image_width();
        std::string pixel;
        ImDrawList& list = *ImGui::GetBackgroundDrawList();
        window_.draw_image(list, width);
        if (pixel_) {
            pixel = pixel_text(*pixel_);
            const float x = static_cast<float>(pixel_->request.pixel->x) + 0.5f;
            const float y = static_cast<float>(pixel_->request.pixel->y) + 0.5f;
            list.AddRect({x - 4, y - 4}, {x + 5, y + 5}, 0xFF000000u);
            list.AddRect({x - 3, y - 3}, {x + 4, y + 4}, 0xFFFFFFFFu);
        }
        if (different_) draw_label(list);
        if (state_.shows_panel) draw_panel(pixel);
        window_.end_frame(width);
    }

    Options options_;
    std::unique_ptr<Animation> animation_;
    ViewState state_;
    Camera first_camera_;
    Window window_;
    Engine engine_;
    bool is_done_ = false;

    std::unique_ptr<TracedImage> image_;
    std::optional<std::uint64_t> different_;
    /// The pixel that was clicked on, until the image is another one.
    std::unique_ptr<TracedImage> pixel_;
    /// The request about a pixel that is not answered yet.
    std::optional<ImageRequest> asked_;

    /// The request in progress or answered last, its step, and whether it is answered.
    ImageRequest posted_;
    int step_ = -1;
    bool is_answered_ = false;
    /// The first request of the state, by which a change is noticed.
    ImageRequest first_request_;
    double changed_at_ = 0;
    double last_ = 0;
};

}  // namespace

void show_scene(const Options& options, const Messages& messages) {
    Viewer(options, messages).run();
}

}  // namespace mray::app
