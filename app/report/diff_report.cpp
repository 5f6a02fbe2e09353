#include "app/report/diff_report.h"

#include <fmt/format.h>

#include <algorithm>

namespace mray::app {

std::uint64_t DiffReport::differing_images() const {
    return static_cast<std::uint64_t>(std::ranges::count_if(
        images, [](const FrameDifference& difference) { return difference.total() != 0; }));
}

std::uint64_t DiffReport::differing_pixels() const {
    std::uint64_t count = 0;
    for (const FrameDifference& difference : images) count += difference.total();
    return count;
}

}  // namespace mray::app
