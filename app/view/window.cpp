#include "app/view/window.h"

#include <GLFW/glfw3.h>
#include <backends/imgui_impl_glfw.h>
#include <backends/imgui_impl_opengl2.h>
#include <fmt/format.h>
#include <imgui.h>

#include <algorithm>
#include <cstdlib>
#include <limits>

#include "common/base/errors.h"

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

}  // namespace

Window::Library::Library() {
#ifdef GLFW_PLATFORM
    // On Wayland a window has no frame without a plugin of libdecor, and glfwTerminate() crashes.
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
    int left = 0;
    int top = 0;
    int room_x = width;
    int room_y = height;
    if (GLFWmonitor* const monitor = glfwGetPrimaryMonitor())
        glfwGetMonitorWorkarea(monitor, &left, &top, &room_x, &room_y);
    width = std::min(width, room_x);
    height = std::min(height, room_y);
    window_.reset(glfwCreateWindow(width, height, title.c_str(), nullptr, nullptr));
    if (!window_) fail("no window can be opened");
    glfwSetWindowSizeLimits(window_.get(), 640, 400, GLFW_DONT_CARE, GLFW_DONT_CARE);
    glfwMakeContextCurrent(window_.get());
    glfwSwapInterval(1);
    glfwSetWindowUserPointer(window_.get(), &keys_);
    // Dear ImGui puts its callback before this one.
    glfwSetKeyCallback(window_.get(), [](GLFWwindow* window, int key, int, int action, int mods) {
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
    ImGui_ImplGlfw_InitForOpenGL(window_.get(), true);
    ImGui_ImplOpenGL2_Init();
}

Window::~Window() { glDeleteTextures(1, &texture_); }

bool Window::closes() const { return glfwWindowShouldClose(window_.get()) != 0; }

void Window::wait(double seconds) { glfwWaitEventsTimeout(seconds); }

void Window::wake() { glfwPostEmptyEvent(); }

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

void Window::set_image(std::uint32_t width, std::uint32_t height,
                       std::span<const std::uint32_t> pixels, std::vector<glm::vec4> line_ends) {
    glBindTexture(GL_TEXTURE_2D, texture_);
    glTexImage2D(GL_TEXTURE_2D, 0, GL_RGBA8, static_cast<GLsizei>(width),
                 static_cast<GLsizei>(height), 0, GL_RGBA, GL_UNSIGNED_BYTE, pixels.data());
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
        const float along = std::max(end.w - nearest, 0.0f) / std::max(farthest - nearest, 1e-30f);
        line_colours_.emplace_back(1.0f, 0.75f, 0.2f, 0.9f - 0.75f * along);
    }
}

void Window::draw_image(float width) const {
    const float height = this->height();
    glEnable(GL_TEXTURE_2D);
    glBindTexture(GL_TEXTURE_2D, texture_);
    glTexEnvi(GL_TEXTURE_ENV, GL_TEXTURE_ENV_MODE, GL_REPLACE);
    glBegin(GL_QUADS);
    for (const auto& [x, y] :
         {std::pair(0, 0), std::pair(1, 0), std::pair(1, 1), std::pair(0, 1)}) {
        glTexCoord2i(x, y);
        glVertex2f(static_cast<float>(x) * width, static_cast<float>(y) * height);
    }
    glEnd();
    glDisable(GL_TEXTURE_2D);
    if (line_ends_.empty()) return;
    // The viewport becomes the image.
    const float scale = pixel_scale();
    glPushAttrib(GL_VIEWPORT_BIT | GL_ENABLE_BIT | GL_COLOR_BUFFER_BIT);
    glViewport(0, 0, static_cast<GLsizei>(width * scale), static_cast<GLsizei>(height * scale));
    glEnable(GL_BLEND);
    glBlendFunc(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA);
    glMatrixMode(GL_PROJECTION);
    glPushMatrix();
    glLoadIdentity();
    glEnableClientState(GL_VERTEX_ARRAY);
    glVertexPointer(4, GL_FLOAT, 0, line_ends_.data());
    glEnableClientState(GL_COLOR_ARRAY);
    glColorPointer(4, GL_FLOAT, 0, line_colours_.data());
    glDrawArrays(GL_LINES, 0, static_cast<GLsizei>(line_ends_.size()));
    glDisableClientState(GL_COLOR_ARRAY);
    glDisableClientState(GL_VERTEX_ARRAY);
    glPopMatrix();
    glPopAttrib();
}

void Window::begin_frame() {
    ImGui_ImplOpenGL2_NewFrame();
    ImGui_ImplGlfw_NewFrame();
    ImGui::NewFrame();
}

void Window::end_frame(float image_width) {
    ImGui::Render();
    int width = 0;
    int height = 0;
    glfwGetFramebufferSize(window_.get(), &width, &height);
    glViewport(0, 0, width, height);
    glClearColor(0.06f, 0.065f, 0.07f, 1);
    glClear(GL_COLOR_BUFFER_BIT);
    glMatrixMode(GL_PROJECTION);
    glLoadIdentity();
    // Screen coordinates, downwards.
    glOrtho(0, this->width(), this->height(), 0, -1, 1);
    glMatrixMode(GL_MODELVIEW);
    glLoadIdentity();
    if (has_image_) draw_image(image_width);
    ImGui_ImplOpenGL2_RenderDrawData(ImGui::GetDrawData());
    glfwSwapBuffers(window_.get());
}

}  // namespace mray::app
