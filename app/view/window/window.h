// A window with OpenGL and Dear ImGui.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

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

/// A key of GLFW that went down.
struct KeyPress {
    int key = 0;
    bool with_ctrl = false;
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
    /// The keys that went down since the last call, in order: also those that are up again.
    std::vector<KeyPress> take_keys();
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
    struct InputLog {
        bool has_any = true;
        std::vector<KeyPress> keys;
    };
    struct Library {
        Library();
        ~Library();
    };
    struct Close {
        void operator()(GLFWwindow* window) const;
    };
    void start_imgui();
    static InputLog& log_of(GLFWwindow* window);
    static void watch_input(GLFWwindow* window);

    Library library_;
    std::unique_ptr<GLFWwindow, Close> window_;
    InputLog input_;
};

}  // namespace mray::app
