// The image in the window, drawn with OpenGL.
#pragma once

#include <cstdint>
#include <span>

#include "app/view/box_lines.h"
#include "app/view/window/window.h"

namespace mray::app {

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

/// Fills a rectangle with a colour.
void fill(const ScreenRect& rect, float red, float green, float blue);

/// Draws lines whose coordinates are pixels of an image that fills `rect` at `pixel_scale` pixels a
/// screen coordinate; `window_height` is in screen coordinates. Nothing is drawn beside `rect`.
void draw_lines(std::span<const ImageLine> lines, const ScreenRect& rect, float pixel_scale,
                float window_height);

}  // namespace mray::app
