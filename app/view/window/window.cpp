#include "app/view/window/window.h"

#include <GLFW/glfw3.h>
#include <backends/imgui_impl_glfw.h>
#include <backends/imgui_impl_opengl2.h>
#include <fmt/format.h>
#include <imgui.h>

#include <cstdlib>
#include <utility>

#include "app/view/window/style.h"
#include "common/base/errors.h"

namespace mray::app {
namespace {

[[noreturn]] void fail(const char* what) {
    const char* reason = nullptr;
    glfwGetError(&reason);
    throw Error(ErrorKind::kUnavailable,
                fmt::format("view: {} ({}); a window needs an X11 display and OpenGL 2.1, which "
                            "Mesa's software renderer has, too",
                            what, reason != nullptr ? reason : "no reason given"));
}

}  // namespace

Window::InputLog& Window::log_of(GLFWwindow* window) {
    return *static_cast<InputLog*>(glfwGetWindowUserPointer(window));
}

/// Callbacks of Dear ImGui are put behind these.
void Window::watch_input(GLFWwindow* window) {
    glfwSetKeyCallback(window, [](GLFWwindow* w, int key, int, int action, int mods) {
        log_of(w).has_any = true;
        if (action == GLFW_PRESS) log_of(w).keys.push_back({key, (mods & GLFW_MOD_CONTROL) != 0});
    });
    glfwSetMouseButtonCallback(window,
                               [](GLFWwindow* w, int, int, int) { log_of(w).has_any = true; });
    glfwSetCursorPosCallback(window,
                             [](GLFWwindow* w, double, double) { log_of(w).has_any = true; });
    glfwSetScrollCallback(window, [](GLFWwindow* w, double, double) { log_of(w).has_any = true; });
    glfwSetCharCallback(window, [](GLFWwindow* w, unsigned) { log_of(w).has_any = true; });
    glfwSetFramebufferSizeCallback(window,
                                   [](GLFWwindow* w, int, int) { log_of(w).has_any = true; });
    glfwSetWindowRefreshCallback(window, [](GLFWwindow* w) { log_of(w).has_any = true; });
    glfwSetWindowFocusCallback(window, [](GLFWwindow* w, int) { log_of(w).has_any = true; });
}

Window::Library::Library() {
#ifdef GLFW_PLATFORM
    // GLFW 3.4 prefers Wayland. There a window has no frame without a plugin of libdecor, and
    // glfwTerminate() crashes.
    if (std::getenv("DISPLAY") != nullptr) glfwInitHint(GLFW_PLATFORM, GLFW_PLATFORM_X11);
#endif
    if (glfwInit() != GLFW_TRUE) fail("no display can be opened");
}

Window::Library::~Library() { glfwTerminate(); }

void Window::Close::operator()(GLFWwindow* window) const {
    if (ImGui::GetCurrentContext() != nullptr) {
        ImGui_ImplOpenGL2_Shutdown();
        ImGui_ImplGlfw_Shutdown();
        ImGui::DestroyContext();
    }
    glfwDestroyWindow(window);
}

Window::Window(const std::string& title, int width, int height) {
    glfwWindowHint(GLFW_CONTEXT_VERSION_MAJOR, 2);
    glfwWindowHint(GLFW_CONTEXT_VERSION_MINOR, 1);
    glfwWindowHint(GLFW_DEPTH_BITS, 0);
    glfwWindowHint(GLFW_STENCIL_BITS, 0);
    window_.reset(glfwCreateWindow(width, height, title.c_str(), nullptr, nullptr));
    if (!window_) fail("no window can be opened");
    glfwSetWindowUserPointer(window_.get(), &input_);
    glfwSetWindowSizeLimits(window_.get(), 640, 400, GLFW_DONT_CARE, GLFW_DONT_CARE);
    glfwMakeContextCurrent(window_.get());
    watch_input(window_.get());
    start_imgui();
}

Window::~Window() = default;

void Window::start_imgui() {
    IMGUI_CHECKVERSION();
    ImGui::CreateContext();
    // No file of settings in the folder that the program is started in.
    ImGui::GetIO().IniFilename = nullptr;
    set_style(pixel_scale());
    ImGui_ImplGlfw_InitForOpenGL(window_.get(), true);
    ImGui_ImplOpenGL2_Init();
}

bool Window::closes() const { return glfwWindowShouldClose(window_.get()) != 0; }

void Window::set_title(const std::string& title) {
    glfwSetWindowTitle(window_.get(), title.c_str());
}

void Window::wait(double seconds) { glfwWaitEventsTimeout(seconds); }

void Window::wake() { glfwPostEmptyEvent(); }

bool Window::take_input() { return std::exchange(input_.has_any, false); }

std::vector<KeyPress> Window::take_keys() { return std::exchange(input_.keys, {}); }

double Window::seconds() { return glfwGetTime(); }

float Window::width() const {
    int width = 0;
    glfwGetWindowSize(window_.get(), &width, nullptr);
    return static_cast<float>(width);
}

float Window::height() const {
    int height = 0;
    glfwGetWindowSize(window_.get(), nullptr, &height);
    return static_cast<float>(height);
}

float Window::pixel_scale() const {
    int pixels = 0;
    glfwGetFramebufferSize(window_.get(), &pixels, nullptr);
    return width() > 0 ? static_cast<float>(pixels) / width() : 1.0f;
}

void Window::set_vsync(bool on) { glfwSwapInterval(on ? 1 : 0); }

void Window::begin_frame() {
    ImGui_ImplOpenGL2_NewFrame();
    ImGui_ImplGlfw_NewFrame();
    ImGui::NewFrame();
}

void Window::end_frame(const std::function<void()>& draw_scene) {
    ImGui::Render();
    int width = 0;
    int height = 0;
    glfwGetFramebufferSize(window_.get(), &width, &height);
    glViewport(0, 0, width, height);
    glMatrixMode(GL_PROJECTION);
    glLoadIdentity();
    // Screen coordinates, downwards.
    glOrtho(0, this->width(), this->height(), 0, -1, 1);
    glMatrixMode(GL_MODELVIEW);
    glLoadIdentity();
    draw_scene();
    ImGui_ImplOpenGL2_RenderDrawData(ImGui::GetDrawData());
    glfwSwapBuffers(window_.get());
}

void Window::copy_to_clipboard(const std::string& text) {
    glfwSetClipboardString(window_.get(), text.c_str());
}

}  // namespace mray::app
