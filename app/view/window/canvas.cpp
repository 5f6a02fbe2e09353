#include "app/view/window/canvas.h"

#include <GLFW/glfw3.h>

#include <cmath>

namespace mray::app {
namespace {

/// OpenGL 1.2, which the header may lack.
constexpr GLint kClampToEdge = 0x812F;

}  // namespace

Painter::PixelRect Painter::pixels_of(const ScreenRect& rect) const {
    const auto to_pixel = [this](float x) { return static_cast<int>(std::lround(x * scale_)); };
    const int left = to_pixel(rect.x);
    const int bottom = to_pixel(window_height_ - rect.y - rect.height);
    return {left, bottom, to_pixel(rect.x + rect.width) - left,
            to_pixel(window_height_ - rect.y) - bottom};
}

void Painter::fill(const ScreenRect& rect, float red, float green, float blue) const {
    const PixelRect p = pixels_of(rect);
    glEnable(GL_SCISSOR_TEST);
    glScissor(p.x, p.y, p.width, p.height);
    glClearColor(red, green, blue, 1);
    glClear(GL_COLOR_BUFFER_BIT);
    glDisable(GL_SCISSOR_TEST);
}

void Painter::lines(std::span<const ImageLine> lines, const ScreenRect& rect) const {
    if (lines.empty()) return;
    static_assert(sizeof(ImageLine) == 4 * sizeof(float));
    const PixelRect p = pixels_of(rect);
    glEnable(GL_SCISSOR_TEST);
    glScissor(p.x, p.y, p.width, p.height);
    glEnable(GL_BLEND);
    glBlendFunc(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA);
    glColor4f(1.0f, 0.75f, 0.2f, 0.6f);
    glPushMatrix();
    glTranslatef(rect.x, rect.y, 0);
    glScalef(1 / scale_, 1 / scale_, 1);
    glEnableClientState(GL_VERTEX_ARRAY);
    glVertexPointer(2, GL_FLOAT, 0, lines.data());
    glDrawArrays(GL_LINES, 0, static_cast<GLsizei>(2 * lines.size()));
    glDisableClientState(GL_VERTEX_ARRAY);
    glPopMatrix();
    glDisable(GL_BLEND);
    glDisable(GL_SCISSOR_TEST);
}

ImageTexture::ImageTexture() {
    glGenTextures(1, &name_);
    glBindTexture(GL_TEXTURE_2D, name_);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_S, kClampToEdge);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_T, kClampToEdge);
}

ImageTexture::~ImageTexture() { glDeleteTextures(1, &name_); }

void ImageTexture::upload(std::uint32_t width, std::uint32_t height,
                          std::span<const std::uint32_t> pixels) {
    if (pixels.empty()) return;
    glBindTexture(GL_TEXTURE_2D, name_);
    const auto w = static_cast<GLsizei>(width);
    const auto h = static_cast<GLsizei>(height);
    if (width == width_ && height == height_) {
        glTexSubImage2D(GL_TEXTURE_2D, 0, 0, 0, w, h, GL_RGBA, GL_UNSIGNED_BYTE, pixels.data());
        return;
    }
    glTexImage2D(GL_TEXTURE_2D, 0, GL_RGBA8, w, h, 0, GL_RGBA, GL_UNSIGNED_BYTE, pixels.data());
    width_ = width;
    height_ = height;
}

void ImageTexture::draw(const ScreenRect& rect, float left, float right) const {
    const float x0 = rect.x + left * rect.width;
    const float x1 = rect.x + right * rect.width;
    const float y1 = rect.y + rect.height;
    glEnable(GL_TEXTURE_2D);
    glBindTexture(GL_TEXTURE_2D, name_);
    glTexEnvi(GL_TEXTURE_ENV, GL_TEXTURE_ENV_MODE, GL_REPLACE);
    glBegin(GL_QUADS);
    glTexCoord2f(left, 0);
    glVertex2f(x0, rect.y);
    glTexCoord2f(right, 0);
    glVertex2f(x1, rect.y);
    glTexCoord2f(right, 1);
    glVertex2f(x1, y1);
    glTexCoord2f(left, 1);
    glVertex2f(x0, y1);
    glEnd();
    glDisable(GL_TEXTURE_2D);
}

}  // namespace mray::app
