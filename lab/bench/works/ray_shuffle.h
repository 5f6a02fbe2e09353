// Rays in an order of no use.
#pragma once

#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "common/interop/ray.h"

namespace mray::bench {

/// The rays in an order in which neighbours have nothing in common; the same on each call.
inline std::vector<Ray> shuffled(std::vector<Ray> rays) {
    std::uint64_t state = 1;
    for (std::size_t i = rays.size(); i > 1; --i) {
        state = state * 6364136223846793005u + 1442695040888963407u;
        std::swap(rays[i - 1], rays[(state >> 33) % i]);
    }
    return rays;
}

}  // namespace mray::bench
