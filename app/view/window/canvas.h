// The image in the window, drawn with OpenGL.
#pragma once

#include <cstdint>
#include <span>

#include "app/view/box_lines.h"
#include "app/view/window/window.h"

namespace mray::app {

/// Draws into rectangles of the window. Needs a current OpenGL context.
class Painter {
public:
    /// Pixels a screen coordinate, and the height of the window in screen coordinates.
    Painter(float pixel_scale, float window_height)
        : scale_(pixel_scale), window_height_(window_height) {}

    /// A rectangle in pixels, from the lower left corner of the window.
    struct PixelRect {
        int x = 0;
        int y = 0;
        int width = 0;
        int height = 0;
    };
    PixelRect pixels_of(const ScreenRect& rect) const;

    void fill(const ScreenRect& rect, float red, float green, float blue) const;
    /// Lines whose coordinates are pixels of an image that fills `rect`. Nothing is drawn beside
    /// it.
    void lines(std::span<const ImageLine> lines, const ScreenRect& rect) const;

private:
    float scale_;
    float window_height_;
};

/// A texture that holds one image. Needs a current OpenGL context all its life.
class ImageTexture {
public:
    ImageTexture();
    ~ImageTexture();
    ImageTexture(const ImageTexture&) = delete;
    ImageTexture& operator=(const ImageTexture&) = delete;

    /// Takes 8-bit RGBA pixels, row by row from the top.
    void upload(std::uint32_t width, std::uint32_t height, std::span<const std::uint32_t> pixels);
    /// Draws the columns from `left` to `right`, parts of the width, where they lie in `rect`.
    void draw(const ScreenRect& rect, float left = 0, float right = 1) const;

private:
    unsigned name_ = 0;
    std::uint32_t width_ = 0;
    std::uint32_t height_ = 0;
};

}  // namespace mray::app
