#include "app/view/difference_image.h"

#include <algorithm>

namespace mray::app {

DifferenceImage difference_of(const TracedPane& first, const TracedPane& second) {
    constexpr std::uint32_t kEqual = 0xFF000000u;
    constexpr std::uint32_t kDifferent = 0xFFFFFFFFu;
    DifferenceImage image;
    image.width = std::min(first.width, second.width);
    image.height = std::min(first.height, second.height);
    image.pixels.resize(std::size_t{image.width} * image.height);
    std::uint32_t* out = image.pixels.data();
    for (std::uint32_t y = 0; y < image.height; ++y) {
        const std::uint32_t* const a = first.pixels.data() + std::size_t{y} * first.width;
        const std::uint32_t* const b = second.pixels.data() + std::size_t{y} * second.width;
        for (std::uint32_t x = 0; x < image.width; ++x) {
            const bool differs = a[x] != b[x];
            image.different += differs ? 1 : 0;
            *out++ = differs ? kDifferent : kEqual;
        }
    }
    return image;
}

}  // namespace mray::app
