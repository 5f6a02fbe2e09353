// The meaning of the colours of an image.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "common/scene/depth_range.h"
#include "morphray/image.hpp"

namespace mray::app {

/// A bar of colours from its left end to its right one, with numbers below it.
struct Legend {
    struct Tick {
        /// From 0, the left end, to 1.
        float place = 0;
        std::string text;
    };
    std::string title;
    /// As in images: red in the lowest bits, and opaque.
    std::vector<std::uint32_t> colours;
    std::vector<Tick> ticks;
};

/// The legend of steps, sah and depth; without colours for any other shading. `depths` is used for
/// depth.
Legend legend_of(morphray::Shading shading, const DepthRange& depths);

}  // namespace mray::app
