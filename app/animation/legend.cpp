#include "app/animation/animation_scene.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <string>
#include <string_view>

#include "common/image/heat_colours.h"
#include "common/interop/lit.h"

namespace mray::app {
namespace {

constexpr std::uint32_t kInk = 0xFFFFFFFFu;
constexpr std::uint32_t kPaper = 0xFF202020u;

/// Glyphs of 3 x 5 dots, row by row from the top, the left dot in the highest bit.
constexpr std::string_view kCharacters = "0123456789.+-adefghilnprst";
constexpr std::uint16_t kGlyphs[] = {075557, 026227, 071747, 071717, 055711, 074717, 074757,
                                     071111, 075757, 075717, 000002, 002720, 000700, 003553,
                                     013553, 003743, 012722, 003536, 046555, 020222, 022222,
                                     006555, 006564, 005644, 003616, 027221};
static_assert(std::size(kGlyphs) == kCharacters.size());
constexpr std::uint32_t kGlyphWidth = 3;
constexpr std::uint32_t kGlyphHeight = 5;

constexpr std::uint32_t kBarWidth = 96;
constexpr std::uint32_t kBarHeight = 5;
constexpr std::uint32_t kGap = 3;
constexpr std::uint32_t kWidth = kBarWidth + 2 * kGap;
constexpr std::uint32_t kHeight = kBarHeight + 2 * kGlyphHeight + 4 * kGap;

/// Draws dots of several pixels, from the upper left corner of the legend.
class Canvas {
public:
    explicit Canvas(morphray::Image& image)
        : image_(image),
          scale_(std::max(std::min(image.width / (3 * kWidth), image.height / (6 * kHeight)), 2u)) {
    }

    bool fits() const {
        return 2 * kWidth * scale_ <= image_.width && 5 * kHeight * scale_ <= image_.height;
    }

    void fill(std::uint32_t x, std::uint32_t y, std::uint32_t width, std::uint32_t height,
              std::uint32_t colour) {
        const std::uint32_t top = image_.height - (kHeight - y) * scale_;
        for (std::uint32_t row = top; row < top + height * scale_; ++row) {
            const std::size_t first = std::size_t{row} * image_.width + x * scale_;
            std::fill_n(image_.pixels.begin() + static_cast<std::ptrdiff_t>(first), width * scale_,
                        colour);
        }
    }

    void write(std::uint32_t x, std::uint32_t y, std::string_view text) {
        for (const char character : text) {
            const std::size_t i = kCharacters.find(character);
            for (std::uint32_t dot = 0; i != kCharacters.npos && dot < 15; ++dot)
                if ((kGlyphs[i] >> (14 - dot) & 1) != 0)
                    fill(x + dot % kGlyphWidth, y + dot / kGlyphWidth, 1, 1, kInk);
            x += kGlyphWidth + 1;
        }
    }

private:
    morphray::Image& image_;
    std::uint32_t scale_;
};

std::uint32_t width_of(std::string_view text) {
    return static_cast<std::uint32_t>(text.size()) * (kGlyphWidth + 1) - 1;
}

struct Scale {
    std::string title;
    std::string labels[3];
};

std::string depth_text(double depth) { return fmt::format("{:.4g}", depth); }

}  // namespace

void draw_legend(morphray::Shading shading, const DepthRange& depths, morphray::Image& image) {
    using morphray::Shading;
    Canvas canvas(image);
    if (!canvas.fits()) return;
    Scale scale;
    if (shading == Shading::depth)
        scale = {"depth",
                 {depth_text(depths.near), depth_text(depths.near + depths.range / 2),
                  depth_text(depths.near + depths.range)}};
    else if (shading == Shading::steps)
        scale = {"steps", {"1", "8", "64+"}};
    else if (shading == Shading::sah)
        scale = {"leaf per triangle area", {"1", "4", "16+"}};
    else
        return;
    const auto colour = [&](float along) {
        if (shading == Shading::depth) return depth_colour(along, 0.0f, 1.0f);
        if (shading == Shading::steps)
            return steps_colour(static_cast<std::uint32_t>(std::exp2(6 * along)));
        return looseness_colour(std::exp2(4 * along));
    };
    canvas.fill(0, 0, kWidth, kHeight, kPaper);
    canvas.write(kGap, kGap, scale.title);
    std::uint32_t y = 2 * kGap + kGlyphHeight;
    for (std::uint32_t x = 0; x < kBarWidth; ++x)
        canvas.fill(kGap + x, y, 1, kBarHeight, colour(static_cast<float>(x) / (kBarWidth - 1)));
    y += kBarHeight + kGap;
    const std::uint32_t place[] = {0, (kBarWidth - width_of(scale.labels[1])) / 2,
                                   kBarWidth - width_of(scale.labels[2])};
    for (int i = 0; i < 3; ++i) canvas.write(kGap + place[i], y, scale.labels[i]);
}

}  // namespace mray::app
