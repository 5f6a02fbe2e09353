// The colours of costs.
#pragma once

#include <cstdint>

namespace mray {

/// A colour from dark blue over green to dark red (after A. Mikhailov. Turbo, an improved rainbow
/// colormap for visualization. 2019), in proportion to the logarithm of n: from 2^first to 2^last.
std::uint32_t heat_colour(std::uint32_t n, std::uint32_t first, std::uint32_t last);

/// heat_colour() of a number of steps, from 1 to 256, and of a looseness, from 1 to 64.
std::uint32_t steps_colour(std::uint32_t steps);
std::uint32_t looseness_colour(float looseness);

}  // namespace mray
