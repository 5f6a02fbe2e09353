#include "common/report/contact_sheet.h"

#include <algorithm>
#include <array>
#include <cassert>

namespace mray {
namespace {

constexpr std::uint32_t kGap = 4;
constexpr std::uint32_t kGapColour = 0xFF202020;

std::uint32_t divide_up(std::uint32_t a, std::uint32_t b) { return a / b + (a % b != 0); }

/// The mean of the block of factor x factor pixels at (x, y), as much of it as there is; (x, y) is
/// inside the image.
std::uint32_t block_mean(const Image& image, std::uint32_t x, std::uint32_t y,
                         std::uint32_t factor) {
    assert(x < image.width && y < image.height && factor > 0);
    const std::uint32_t x_end = std::min(x + factor, image.width);
    const std::uint32_t y_end = std::min(y + factor, image.height);
    std::array<std::uint64_t, 4> sum = {};
    for (std::uint32_t row = y; row < y_end; ++row) {
        for (std::uint32_t column = x; column < x_end; ++column) {
            const std::uint32_t pixel = image.pixels[std::size_t{row} * image.width + column];
            for (unsigned i = 0; i < 4; ++i) sum[i] += (pixel >> (8 * i)) & 0xFF;
        }
    }
    const std::uint64_t count = std::uint64_t{x_end - x} * (y_end - y);
    std::uint32_t mean = 0;
    for (unsigned i = 0; i < 4; ++i) {
        mean |= static_cast<std::uint32_t>((sum[i] + count / 2) / count) << (8 * i);
    }
    return mean;
}

/// The number of columns that makes the sheet closest to square, at least 1.
std::uint32_t column_count(std::size_t images, std::uint32_t width, std::uint32_t height) {
    std::uint32_t columns = 1;
    while (columns < images &&
           std::uint64_t{columns} * width <
               std::uint64_t{divide_up(static_cast<std::uint32_t>(images), columns)} * height) {
        ++columns;
    }
    return columns;
}

}  // namespace

Image contact_sheet(std::span<const Image> images, std::uint32_t max_width) {
    if (images.empty() || images[0].width == 0 || images[0].height == 0) return {};
    const std::uint32_t width = images[0].width;
    const std::uint32_t height = images[0].height;
    const std::uint32_t columns = column_count(images.size(), width, height);
    const std::uint32_t rows = divide_up(static_cast<std::uint32_t>(images.size()), columns);
    const std::uint32_t cell_limit = std::max(1u, max_width / columns);
    const std::uint32_t factor = divide_up(width, cell_limit);
    const std::uint32_t cell_width = divide_up(width, factor);
    const std::uint32_t cell_height = divide_up(height, factor);

    Image sheet;
    sheet.width = columns * (cell_width + kGap) - kGap;
    sheet.height = rows * (cell_height + kGap) - kGap;
    sheet.pixels.assign(std::size_t{sheet.width} * sheet.height, kGapColour);
    for (std::size_t i = 0; i < images.size(); ++i) {
        const Image& image = images[i];
        assert(image.width == width && image.height == height);
        const std::size_t left = (i % columns) * (cell_width + kGap);
        const std::size_t top = (i / columns) * (cell_height + kGap);
        for (std::uint32_t y = 0; y < cell_height; ++y) {
            for (std::uint32_t x = 0; x < cell_width; ++x) {
                sheet.pixels[(top + y) * sheet.width + left + x] =
                    block_mean(image, x * factor, y * factor, factor);
            }
        }
    }
    return sheet;
}

}  // namespace mray
