// A window with OpenGL and Dear ImGui.
#pragma once

#include <functional>
#include <memory>
#include <string>

struct GLFWwindow;

namespace mray::app {

/// A rectangle of the window in screen coordinates, from its upper left corner.
struct ScreenRect {
    float x = 0;
    float y = 0;
    float width = 0;
    float height = 0;
    bool contains(float px, float py) const {
        return px >= x && py >= y && px < x + width && py < y + height;
    }
};

/// The one window of the program. Used by the main thread alone, but for wake().
class Window {
public:
    /// Throws Error(kUnavailable) without a display or without OpenGL 2.1.
    Window(const std::string& title, int width, int height);
    ~Window();
    Window(const Window&) = delete;
    Window& operator=(const Window&) = delete;

    /// Whether the user has closed it.
    bool closes() const;
    void set_title(const std::string& title);
    /// Waits for input or wake(), at most so long; handles input.
    void wait(double seconds);
    /// Ends wait(). Any thread.
    static void wake();
    /// Whether there was input since the last call.
    bool take_input();
    static double seconds();

    float width() const;
    float height() const;
    /// Pixels a screen coordinate.
    float pixel_scale() const;
    void set_vsync(bool on);

    /// Begins a frame of Dear ImGui.
    void begin_frame();
    /// Draws what `draw_scene` does with OpenGL, and over it Dear ImGui's frame; presents both.
    void end_frame(const std::function<void()>& draw_scene);
    void copy_to_clipboard(const std::string& text);

private:
    struct Library {
        Library();
        ~Library();
    };
    struct Close {
        void operator()(GLFWwindow* window) const;
    };
    void start_imgui();

    Library library_;
    std::unique_ptr<GLFWwindow, Close> window_;
    bool has_input_ = true;
};

}  // namespace mray::app
