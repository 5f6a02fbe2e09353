#include "app/view/window/canvas.h"

#include <GLFW/glfw3.h>

#include <cmath>

namespace mray::app {
namespace {

// OpenGL 1.2 and 3.0, which headers may lack.
constexpr GLint kClampToEdge = 0x812F;
constexpr GLenum kBgra = 0x80E1;
constexpr GLenum kReversedBytes = 0x8367;
constexpr GLenum kReadFramebuffer = 0x8CA8;
constexpr GLenum kColourAttachment = 0x8CE0;

/// Functions of OpenGL 3.0, or of ARB_framebuffer_object; null where there are none.
struct FramebufferFunctions {
    void (*generate)(GLsizei, GLuint*) = nullptr;
    void (*remove)(GLsizei, const GLuint*) = nullptr;
    void (*bind)(GLenum, GLuint) = nullptr;
    void (*attach)(GLenum, GLenum, GLenum, GLuint, GLint) = nullptr;
    void (*blit)(GLint, GLint, GLint, GLint, GLint, GLint, GLint, GLint, GLbitfield,
                 GLenum) = nullptr;

    bool complete() const { return generate && remove && bind && attach && blit; }
};

template <class Function>
void load(Function& function, const char* name) {
    function = reinterpret_cast<Function>(glfwGetProcAddress(name));
}

FramebufferFunctions load_functions() {
    FramebufferFunctions functions;
    load(functions.generate, "glGenFramebuffers");
    load(functions.remove, "glDeleteFramebuffers");
    load(functions.bind, "glBindFramebuffer");
    load(functions.attach, "glFramebufferTexture2D");
    load(functions.blit, "glBlitFramebuffer");
    return functions;
}

const FramebufferFunctions& functions() {
    static const FramebufferFunctions loaded = load_functions();
    return loaded;
}

std::uint32_t swap_red_and_blue(std::uint32_t p) {
    return (p & 0xFF00FF00u) | (p & 0xFFu) << 16 | (p >> 16 & 0xFFu);
}

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
    if (functions().complete()) functions().generate(1, &framebuffer_);
}

ImageTexture::~ImageTexture() {
    if (framebuffer_ != 0) functions().remove(1, &framebuffer_);
    glDeleteTextures(1, &name_);
}

void ImageTexture::upload(std::uint32_t width, std::uint32_t height,
                          std::span<const std::uint32_t> pixels) {
    if (pixels.empty()) return;
    // The order of a window's pixels, so that no pixel is converted on the way there.
    swapped_.resize(pixels.size());
    for (std::size_t i = 0; i < pixels.size(); ++i) swapped_[i] = swap_red_and_blue(pixels[i]);
    glBindTexture(GL_TEXTURE_2D, name_);
    const auto w = static_cast<GLsizei>(width);
    const auto h = static_cast<GLsizei>(height);
    if (width == width_ && height == height_) {
        glTexSubImage2D(GL_TEXTURE_2D, 0, 0, 0, w, h, kBgra, kReversedBytes, swapped_.data());
        return;
    }
    glTexImage2D(GL_TEXTURE_2D, 0, GL_RGBA8, w, h, 0, kBgra, kReversedBytes, swapped_.data());
    width_ = width;
    height_ = height;
    if (framebuffer_ == 0) return;
    functions().bind(kReadFramebuffer, framebuffer_);
    functions().attach(kReadFramebuffer, kColourAttachment, GL_TEXTURE_2D, name_, 0);
    functions().bind(kReadFramebuffer, 0);
}

void ImageTexture::draw(const Painter& painter, const ScreenRect& rect, float left,
                        float right) const {
    const Painter::PixelRect to = painter.pixels_of(rect);
    if (framebuffer_ == 0 || to.width != static_cast<int>(width_) ||
        to.height != static_cast<int>(height_)) {
        stretch(rect, left, right);
        return;
    }
    const auto column = [&](float part) {
        return static_cast<int>(std::lround(part * static_cast<float>(to.width)));
    };
    copy(to, column(left), column(right));
}

/// Copies columns without a change of size. A software renderer, which takes several times as long
/// for a textured rectangle, copies memory then. The rows of the image go from the top, those of
/// the window from the bottom.
void ImageTexture::copy(const Painter::PixelRect& to, int from, int end) const {
    functions().bind(kReadFramebuffer, framebuffer_);
    functions().blit(from, 0, end, to.height, to.x + from, to.y + to.height, to.x + end, to.y,
                     GL_COLOR_BUFFER_BIT, GL_NEAREST);
    functions().bind(kReadFramebuffer, 0);
}

void ImageTexture::stretch(const ScreenRect& rect, float left, float right) const {
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
