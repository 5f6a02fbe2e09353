// A window that shows an image and lines with OpenGL, and Dear ImGui over them.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <glm/vec4.hpp>

#include "common/scene/camera_setup.h"

struct GLFWwindow;

namespace mray::app {

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

    bool closes() const;
    /// Waits for input or wake(), at most so long; handles input.
    void wait(double seconds);
    /// Ends wait(). Any thread may call it.
    static void wake();
    /// The keys that went down since the last call, in order: also those that are up again.
    std::vector<KeyPress> take_keys() { return std::exchange(keys_, {}); }
    static double seconds();

    /// Sizes are in screen coordinates.
    float width() const;
    float height() const;
    /// Screens of high density have several pixels a screen coordinate.
    float pixel_scale() const;

    /// 8-bit RGBA pixels from the top, and the ends of lines over them, in clip space of the image.
    void set_image(std::uint32_t width, std::uint32_t height, std::span<const std::uint32_t> pixels,
                   std::vector<glm::vec4> line_ends);

    void begin_frame();
    /// Draws the image in the left part, of this width, under Dear ImGui's frame; presents both.
    void end_frame(float image_width);

private:
    struct Library {
        Library();
        ~Library();
    };
    struct Close {
        void operator()(GLFWwindow* window) const;
    };
    void draw_image(float width) const;

    Library library_;
    std::unique_ptr<GLFWwindow, Close> window_;
    std::vector<KeyPress> keys_;
    unsigned texture_ = 0;
    bool has_image_ = false;
    std::vector<glm::vec4> line_ends_;
    /// They fade with the distance from the eye.
    std::vector<glm::vec4> line_colours_;
};

}  // namespace mray::app
