// Where the images of two backends differ.
#pragma once

#include <cstdint>
#include <vector>

#include "app/view/image_request.h"

namespace mray::app {

/// White where two images of one size differ in any bit, black where they are equal; where one is
/// wider or higher, what is beyond the other is left out.
struct DifferenceImage {
    std::uint32_t width = 0;
    std::uint32_t height = 0;
    std::vector<std::uint32_t> pixels;
    std::uint64_t different = 0;
};
DifferenceImage difference_of(const TracedPane& first, const TracedPane& second);

}  // namespace mray::app
