// Pages as a browser shows and prints them: headless Chromium, and pdftotext of Poppler.
#pragma once

#include <string>

namespace mray::test {

/// Whether chromium and pdftotext are installed; tests of pages are skipped without them.
bool has_browser();
inline constexpr const char* kNoBrowser =
    "chromium or pdftotext is not installed: sudo apt-get install chromium poppler-utils";

/// A page in a window of some width, or on paper.
struct ShownPage {
    /// The width of its content, in pixels: more than that of the window if it has to be scrolled
    /// sideways as a whole.
    int content_width = 0;
    /// The most that a drawing is wider than its place, in pixels, so that it has to be scrolled.
    int drawing_excess = 0;
    /// The least size of shown text on the screen, in pixels, texts of images included.
    double least_text_px = 0;
    /// The brightness of background and text, 0 to 255.
    int background = 0;
    int foreground = 0;
    /// The text that it shows.
    std::string text;
};

/// Shows a page in a window that is `width` pixels wide. Throws std::runtime_error if the browser
/// gives no answer. If MORPHRAY_SCREENSHOTS is in the environment, its folder gets the image
/// NAME-WIDTH-light.png or -dark.png.
ShownPage show_page(const std::string& html, int width, bool dark, const std::string& name);

/// The text of the page, printed on A4, as far as it is on the paper.
std::string printed_text(const std::string& html, const std::string& name);

}  // namespace mray::test
